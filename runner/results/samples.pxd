# Types for C; what everything is for is said in samples.py.


cdef class Samples:
    cdef public object times, microsteps, tokens, kind
    cpdef add(self, long long time, long microstep, token)
