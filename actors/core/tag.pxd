# Types for C; what everything is for is said in tag.py.

cimport cython
from epicycle.actors.core.primitives cimport nearest

cdef double _FAR


@cython.locals(product=cython.double)
cpdef to_nanoseconds(seconds)
cpdef to_seconds(nanoseconds)
