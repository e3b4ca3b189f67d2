# Types for C; what everything is for is said in random.py.


cdef class Words:
    cdef public list _ahead
    cdef public object _bits
    cdef public long _block
    cpdef word(self)
