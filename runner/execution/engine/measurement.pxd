# Types for C; measurement.py has the documentation.

cimport cython
from epicycle.actors cimport Receiver
from epicycle.runner.execution.engine.agenda cimport Instant
from epicycle.runner.execution.engine.batches cimport TimeBatches, TokenBatches
from epicycle.runner.execution.engine.director cimport Director
from epicycle.runner.execution.engine.statistic cimport MOST, Statistic


cdef class Measurement:
    cdef public object _measure, _ports
    cdef public _Kept _kept
    cdef public _Taking _taking
    cdef public dict _holds
    cdef public long long _until
    cdef public bint _is_beyond, _is_of_floats, _is_of_numbers
    cpdef add(self, str port, long long time, token)
    @cython.locals(number=cython.double)
    cpdef _value(self, token)


cdef class Measuring(Receiver):
    cdef public Measurement measurement
    cdef public str port
    cdef public Director director
    @cython.locals(now=Instant)
    cpdef put(self, token)


cdef class _Taking:
    cdef public long long start, _count
    cdef public object _measure, _unfit
    cdef public Statistic _statistic
    cpdef add(self, str port, long long time, value)


cdef class _Tokens(_Taking):
    cdef public TokenBatches _batches
    cpdef add(self, str port, long long time, value)


cdef class _Spells(_Taking):
    cdef public TimeBatches _batches
    cdef public dict _open
    cpdef add(self, str port, long long time, value)
    @cython.locals(stood=tuple, begin=cython.longlong)
    cpdef _close(self, str port, long long time)


cdef class _Arrivals(_Taking):
    cdef public TimeBatches _batches
    cpdef add(self, str port, long long time, value)


cdef class _Kept:
    cdef public list _names
    cdef public dict _numbers
    cdef public object _ports, _times, _values, _unfit
    cpdef add(self, str port, long long time, value)
