# Types for C; agenda.py has the documentation.

cimport cython
from epicycle.actors cimport InputPort, Moment, Wake, Receiver, is_alone


@cython.final
cdef class Activation:
    cdef public object actor
    cdef public Form form
    cdef public long rank
    cdef public list later, ports, wakes
    cdef public Wake wake
    cdef public bint is_scheduled
    cpdef add(self, Wake wake)
    @cython.locals(wake=Wake, due=cython.bint)
    cpdef bint use_wakes(self) except -1
    @cython.locals(port=InputPort, found=Py_ssize_t)
    cpdef Py_ssize_t new(self) except -1
    @cython.locals(port=InputPort)
    cpdef hold(self)
    @cython.locals(port=InputPort)
    cpdef clear(self)


cdef class Form:
    cpdef fire(self)


@cython.final
cdef class Instant(Moment):
    cdef public list pending, activations, wakes
    cdef public Activation activation
    cdef public Wake wake
    cpdef add(self, Activation activation, Wake wake)
    @cython.locals(place=cython.Py_ssize_t)
    cpdef join(self, Instant other)


@cython.locals(instant=Instant)
cpdef Instant new_instant(long long time, long microstep, Instant past=*)


@cython.final
cdef class Delivery:
    cdef public Receiver way
    cdef public object token
    cpdef arrive(self)
