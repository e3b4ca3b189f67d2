# Types for C; primitives.py documents everything.

from libc.stdint cimport uint64_t


cdef struct Source:  # how the interface of NumPy's bit generators begins
    void* state
    uint64_t (*next_uint64)(void*) noexcept


cdef class Words:
    cdef public list _ahead
    cdef object bits
    cdef Source* source
    cpdef uint64_t word(self) except? 0


cdef long long nearest(double number) noexcept
cdef double log(double x) except? -1.0
cpdef bint is_alone(thing) noexcept
cdef int empty(list tokens) except -1
cdef tuple reduced(thing)
