# Types for C; log.py has the documentation.

cimport cython

from epicycle.runner.results.packing cimport TAKES_NUMBERS, Sheet

cdef Py_ssize_t _MANY, _MOST


cdef class Writer:
    cdef public EventLog log
    cdef public tuple names
    cdef public bytes _head
    cdef public object _keep
    @cython.locals(log=EventLog, sheet=Sheet)
    cpdef write(self, when, value)


cdef class EventLog:
    cdef public Sheet sheet
    cdef public object records
    cdef public object tokens
    cdef public object when, crowd, _hash, _keeps, _log_to
    cdef public dict _writers
    cdef public long long _hashed
    cpdef turn_to(self, when)
    cpdef hash_many(self, port)
    cpdef hash_records(self)
