# Types for C; laws.py documents everything.

cimport cython
from libc.math cimport sqrt
from epicycle.actors.core.primitives cimport Words, log

cdef double _STEP


cpdef double between(Words bits) except? -1.0
cpdef uniform(Words bits, low=*, high=*)
cpdef double standard_normal(Words bits) except? -1e300
@cython.locals(q=double, r=double, above=double, below=double)
cpdef double normal_quantile(double share) except? -1e300
cpdef normal(Words bits, loc=*, scale=*)
cpdef double standard_exponential(Words bits) except? -1.0
cpdef double exponential(Words bits, scale=*) except? -1.0
@cython.locals(d=double, c=double, x=double, v=double, square=double, share=double)
cpdef double standard_gamma(Words bits, shape) except? -1.0
cpdef double gamma(Words bits, shape, scale=*) except? -1.0
