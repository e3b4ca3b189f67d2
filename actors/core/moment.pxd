# Types for C; moment.py documents everything.

cimport cython


@cython.freelist(64)
cdef class Wake:
    cdef public long long time
    cdef public long microstep
    cdef public bint cancelled, due


cdef class Moment:
    cdef public long long time
    cdef public long microstep
    cdef public object _tag


@cython.locals(wake=Wake)
cpdef Wake new_wake(long long time, long microstep)
