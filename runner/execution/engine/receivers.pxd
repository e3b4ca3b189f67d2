# Types for C; receivers.py has the documentation.

cimport cython
from epicycle.actors cimport Emitter, Receiver
from epicycle.runner.execution.engine.director cimport Director
from epicycle.runner.execution.engine.agenda cimport Instant
from epicycle.runner.execution.results cimport Samples, Writer


cdef class Call(Receiver):
    cdef public object function
    cpdef put(self, token)


cdef class Recording(Receiver):
    cdef public Samples samples
    cdef public Director director
    @cython.locals(now=Instant)
    cpdef put(self, token)


cdef class Fork(Receiver):
    cdef public list ways
    @cython.locals(way=Receiver)
    cpdef put(self, token)


cdef class Delayed(Receiver):
    cdef public object director, delay
    cdef public Receiver onward
    cpdef put(self, token)


cdef class AspectCall(Receiver):
    cdef public object act, aspect, doing, point
    cdef public bint is_always_active
    cpdef put(self, token)
    cpdef show(self, token, point)
    cpdef holds(self, point)


cdef class Sender(Emitter):
    cdef public object port, channels
    cdef public Director director
    cdef public Writer writer
    cdef public Receiver onward
    cdef public dict single
    cpdef put(self, token)
    cpdef Receiver to(self, channel)


cdef class WovenSender(Emitter):
    cdef public Sender sender
    cdef public object woven
    cdef public dict entries
    cpdef put(self, token)
    cpdef Receiver to(self, channel)
