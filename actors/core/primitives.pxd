# Types for C; what everything is for is said in primitives.py.

cdef long long nearest(double number) noexcept
cdef int empty(list tokens) except -1
