# Types for C; ports.py documents everything.

cimport cython
from epicycle.actors.core.primitives cimport empty


cdef class Way:
    cpdef go(self, token)


cdef class Emitter(Way):
    cpdef send(self, token, channel=*)


cdef class _Told(Emitter):
    cdef public object function
    cpdef send(self, token, channel=*)


cdef class Port:
    cdef public object actor, type, doc, ptolemy
    cdef public bint multi
    cdef public str name, path
    cdef public Py_ssize_t width
    cpdef tell(self, bound)


cdef class Kept:
    cdef public list lines
    cdef public Py_ssize_t count, number
    cpdef put(self, token, channel)
    cpdef get(self, channel)
    cpdef list in_order(self)


cdef class InputPort(Port):
    cdef public list arrived, channels, shown
    cdef public bint keep, required, triggers
    cdef public Kept kept
    cpdef tell(self, bound)
    cpdef receive(self, token, channel)
    cpdef prepare(self)
    cpdef clear(self)
    cpdef put_in_line(self)
    cpdef take(self)
    cpdef give(self, taken)


cdef class OutputPort(Port):
    cdef public object depends_on
    cdef public Emitter emitter
    cpdef tell(self, bound)
    cpdef send(self, token, channel=*)
