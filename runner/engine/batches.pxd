# Types for C; what everything is for is said in batches.py.

cimport cython


cdef class TokenBatches:
    cdef public long long _size, _count
    cdef public double _sum
    cdef public list _sums
    cpdef add(self, double value)


cdef class TimeBatches:
    cdef public long long _start, _width
    cdef public Py_ssize_t _most
    cdef public list _sums, _covered
    @cython.locals(
        first=Py_ssize_t, last=Py_ssize_t, index=Py_ssize_t, edge=cython.longlong, length=cython.double,
        sums=list, covered=list,
    )
    cpdef add(self, double value, long long begin, long long end)
    @cython.locals(index=Py_ssize_t)
    cpdef Py_ssize_t _slice(self, long long time) except -1
    @cython.locals(index=Py_ssize_t, sums=list)
    cpdef count(self, long long time)
