# Types for C; what everything is for is said in parameter.py.


cdef class Parameter:
    cdef dict __dict__
    cdef object __weakref__
