# Types for C; parameter.py documents everything.


cdef class Parameter:
    cdef dict __dict__
    cdef object __weakref__
