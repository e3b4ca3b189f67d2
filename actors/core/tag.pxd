# Types for C; tag.py documents everything.

cimport cython
from epicycle.actors.core.primitives cimport nearest

cdef double _FAR


cdef inline long long nanoseconds_of(double seconds) except? -1:
    """``to_nanoseconds`` of a float."""
    cdef double product = seconds * 1e9
    return nearest(product) if -_FAR <= product <= _FAR else to_nanoseconds(seconds)


cdef inline double seconds_of(long long nanoseconds) except? -1.0:
    """``to_seconds`` of a whole number."""
    return nanoseconds / 1e9 if -(1LL << 53) < nanoseconds < (1LL << 53) else to_seconds(nanoseconds)



@cython.locals(product=cython.double)
cpdef to_nanoseconds(seconds)
cpdef to_seconds(nanoseconds)


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
