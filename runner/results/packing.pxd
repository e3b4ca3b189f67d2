# Types for C; packing.py has the documentation.

cimport cython

cdef bint TAKES_NUMBERS


cpdef bytes stamp(when)


@cython.final
cdef class Sheet:
    cdef readonly Py_ssize_t size
    cdef char* buffer
    cdef Py_ssize_t used, room
    cdef char tag[18]
    cdef list places, tokens
    cpdef turn_to(self, when)
    cpdef bint add(self, bytes head, value) except -1
    cpdef keep(self, bytes head, kept)
    cdef char* begun(self, bytes head, Py_ssize_t more) except NULL
