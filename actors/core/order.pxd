# Types for C; order.py documents everything.

cimport cython
from epicycle.actors.core.tag cimport Wake


@cython.final
cdef class ReadyQueue:
    cdef long long* items
    cdef Py_ssize_t size, room
    cdef int push(self, long long rank) except -1
    cdef long long pop(self) noexcept


cdef struct Item:
    long long time, number
    long microstep
    Py_ssize_t place  # of the value and its wake-up, in the lists


@cython.final
cdef class TimedQueue:
    cdef list wakes, values
    cdef Item* heap
    cdef Py_ssize_t* free
    cdef Py_ssize_t size, room, unused
    cdef public long long number
    cdef long long first(self) noexcept
    cpdef push(self, Wake wake, value)
    cdef Py_ssize_t put(self, long long time, long microstep, Wake wake, value) except -1
    cdef bint is_before(self, long long time, long microstep) noexcept
    cpdef bint is_due(self) except -1
    cpdef pop(self)
    cpdef list due(self)
    cdef int _insert(self, Item item, wake, value) except -1
