# Types for C; ports.py documents everything.

cimport cython
from epicycle.actors.core.primitives cimport empty


cdef class Receiver:
    cpdef put(self, token)


cdef class Emitter(Receiver):
    cpdef Receiver to(self, channel)


cdef class _Told(Emitter):
    cdef public object channel, function
    cpdef put(self, token)
    cpdef Receiver to(self, channel)


cdef class Terms:
    cdef public object depends_on, doc, independent_of, type
    cdef public bint multi, required, triggers
    cdef public str name
    cpdef Terms but(self, str option, value)


cdef class Port:
    cdef public object actor
    cdef public Terms terms
    cdef public str path
    cdef public Py_ssize_t width
    @cython.locals(bound=Port)
    cpdef twin(self, actor)
    cpdef begin(self, like)


cdef class InputPort(Port):
    cdef public list arrived, channels, shown
    cpdef begin(self, like)
    cpdef open(self)
    cpdef receive(self, token, channel)
    cpdef clear(self)


cdef class OutputPort(Port):
    cdef public Emitter emitter
    cpdef begin(self, like)
    @cython.locals(emitter=Emitter)
    cpdef send(self, token, channel=*)
