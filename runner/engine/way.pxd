# Types for C; way.py has the documentation.

cimport cython
from epicycle.actors cimport Emitter, Way
from epicycle.runner.engine.director cimport Director
from epicycle.runner.results cimport Writer


cdef class Call(Way):
    cdef public object function
    cpdef go(self, token)


cdef class Fork(Way):
    cdef public list ways
    @cython.locals(way=Way)
    cpdef go(self, token)


cdef class Delayed(Way):
    cdef public object director, delay
    cdef public Way onward
    cpdef go(self, token)


cdef class Guarded(Way):
    cdef public object act, doing, holds, pass_by, point, tell
    cpdef go(self, token)


cdef class Sender(Emitter):
    cdef public object port, channels
    cdef public Director director
    cdef public Writer writer
    cdef public Way onward
    cdef public dict single
    cpdef go(self, token)
    cpdef send(self, token, channel=*)
    cpdef Sender to(self, channel)


cdef class Screened(Emitter):
    cdef public Sender sender
    cdef public object woven
    cdef public dict entries
    cpdef send(self, token, channel=*)
