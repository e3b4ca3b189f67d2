# Types for C; primitives.py documents everything.

from libc.stdint cimport uint64_t


cdef class Words:
    cdef public object _bits
    cdef public int _block
    cdef uint64_t words[64]
    cdef int left
    cpdef uint64_t word(self) except? 0


cdef long long nearest(double number) noexcept
cdef double log(double x) except? -1.0
cpdef bint is_alone(thing) noexcept
cdef int empty(list tokens) except -1
cdef tuple reduced(thing)
