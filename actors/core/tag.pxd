# Types for C; what everything is for is said in tag.py.

cimport cython
from epicycle.actors.core.primitives cimport nearest


@cython.locals(product=cython.double)
cpdef to_nanoseconds(seconds)
cpdef to_seconds(nanoseconds)
