# Types for C; order.py documents everything.

cimport cython
from epicycle.actors.core.moment cimport Moment, Wake


@cython.final
cdef class ReadyQueue:
    cdef long long* items
    cdef readonly Py_ssize_t size
    cdef Py_ssize_t room
    cdef int push(self, long long rank) except -1
    cdef long long pop(self) except? -1


cdef struct Slot:
    long long time
    Py_ssize_t number  # of what is to be done, in the list; below 0 where there is nothing


@cython.final
cdef class Calendar:
    cdef ReadyQueue heap
    cdef list instants
    cdef Py_ssize_t* free  # places in the list
    cdef Slot* table
    cdef readonly Py_ssize_t size
    cdef Py_ssize_t room, mask, unused  # room of free
    cdef long long first(self)
    cdef object at(self, long long time)
    cdef int add(self, Moment instant) except -1
    cdef int put_in(self, long long time, instant) except -1
    cdef object pop(self)
    cdef int _widen(self) except -1
    cdef void _put(self, long long time, Py_ssize_t number) noexcept


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
    cpdef push(self, Wake wake, value)
    cdef int put(self, long long time, long microstep, Wake wake, value) except -1
    cdef bint is_before(self, long long time, long microstep) noexcept
    cpdef bint is_due(self) except -1
    cpdef pop(self)
    cdef int _insert(self, Item item, wake, value) except -1
