# Types for C; statistic.py has the documentation.

cimport cython

cdef double MOST, NANOSECONDS
cdef Py_ssize_t _KEPT


cdef class Total:
    cdef public list _terms
    cpdef add(self, double value)


cdef class Statistic:
    cpdef add(self, value, long long weight)


cdef class First(Statistic):
    cdef public bint _is_empty, _last
    cdef public object _value
    cpdef add(self, value, long long weight)


cdef class Least(Statistic):
    cdef public bint _greatest
    cdef public object _value
    cpdef add(self, value, long long weight)


cdef class Count(Statistic):
    cdef public long long _count
    cpdef add(self, value, long long weight)


cdef class Sum(Statistic):
    cdef public object _whole
    cdef public Total _rest
    cpdef add(self, value, long long weight)


cdef class Mean(Statistic):
    cdef public Total _total
    cdef public object _weight
    @cython.locals(number=cython.double)
    cpdef add(self, value, long long weight)


cdef class Spread(Statistic):
    cdef public bint _is_sample
    cdef public object _weight, _mean, _squares
    cpdef add(self, value, long long weight)


cdef class Quantile(Statistic):
    cdef public object _p, _values
    cpdef add(self, value, long long weight)


cdef class TimeQuantile(Statistic):
    cdef public object _p
    cdef public dict _weights
    cpdef add(self, value, long long weight)
