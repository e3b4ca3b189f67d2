# Types for C; batches.py has the documentation.

cimport cython


@cython.locals(found=list, index=Py_ssize_t, first=cython.double, second=cython.double)
cpdef list _pairs(list sums)


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
        last=cython.longlong, index=cython.longlong, edge=cython.longlong, width=cython.longlong, length=cython.double,
        before=cython.double, sums=list, covered=list,
    )
    cpdef add(self, double value, long long begin, long long end)
    @cython.locals(index=cython.longlong, missing=cython.longlong)
    cpdef Py_ssize_t _slice(self, long long time) except -1
    @cython.locals(index=cython.longlong)
    cpdef count(self, long long time)
