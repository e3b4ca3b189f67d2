# Types for C; what everything is for is said in samples.py.

from cpython cimport array


cdef class Samples:
    cdef public array.array times, microsteps
    cdef public object tokens, kind
    cpdef add(self, long long time, long microstep, token)
