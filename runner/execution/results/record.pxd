# Types for C; record.py has the documentation.

cimport cython
from cpython cimport array
from libc.stdint cimport uint64_t


@cython.final
cdef class RecordHash:
    cdef readonly Py_ssize_t count
    cdef public Py_ssize_t at_tag
    cdef public object _hash
    cdef char* buffer
    cdef Py_ssize_t used, end, room  # ``end`` is that of a record in the making
    cdef uint64_t names
    cdef object when
    cdef long long time
    cdef long microstep
    cdef bint is_fixed
    cdef int level  # of the lists and mappings around what is encoded
    cdef dict known
    cdef bytes add(self, bytes number, tuple names, when, value)
    cdef int need(self, Py_ssize_t more) except -1
    cdef int put_bytes(self, bytes data) except -1
    cdef void put_little(self, uint64_t number, int size) noexcept
    cdef void put_float(self, double number) noexcept
    cdef void put_unsigned(self, uint64_t number) noexcept
    cdef int put_known(self, token) except -1
    cdef int put(self, token, int depth) except -1
    cdef int put_array(self, token) except -1
    cdef int put_mapping(self, dict token, int depth) except -1
    cdef int put_other(self, token) except -1
    cdef int update(self) except -1


cdef class Writer:
    cdef public object log
    cdef public tuple names
    cdef public bytes _number
    cdef public RecordHash _hash
    cdef public bint _keeps
    cpdef write(self, when, value)


cdef class Samples:
    cdef public array.array times, microsteps
    cdef public object tokens, kind
    cpdef add(self, long long time, long microstep, token)
