# Types for C; port_parameter.py documents everything.

cimport cython
from epicycle.actors.core.parameter cimport Parameter
from epicycle.actors.core.ports cimport InputPort

cdef object _NOTHING


cdef class ParameterPort(InputPort):
    cdef public object given, _before, _current, _parameter, _received
    cdef public bint has_received
    cpdef begin(self, like)
    cpdef start_with(self, value)
    cpdef reset(self)
    cpdef receive(self, token, channel)
    cpdef take(self)
    cpdef give(self, taken)
    cpdef settle(self, value)
    cpdef current(self)


@cython.final
cdef class PortParameter(Parameter):
    cdef public ParameterPort port
    cdef public object port_name
    cpdef ParameterPort port_of(self, instance)
