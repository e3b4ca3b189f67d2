# Types for C; what everything is for is said in laws.py.

cimport cython


@cython.locals(q=double, r=double, above=double, below=double)
cpdef double normal_quantile(double share) except? -1e300
