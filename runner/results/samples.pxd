# Types for C; samples.py has the documentation.

from cpython cimport array


cdef class Samples:
    cdef public array.array times, microsteps
    cdef public object tokens, kind
    cpdef add(self, long long time, long microstep, token)
