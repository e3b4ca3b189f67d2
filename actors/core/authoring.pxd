# Types for C; authoring.py documents everything.

from epicycle.actors.core.order cimport Line


cdef class Pending:
    cdef public object _actor
    cdef public Line _line
    cpdef put(self, value, delay)
    cpdef due(self)
