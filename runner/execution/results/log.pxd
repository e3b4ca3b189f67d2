# Types for C; log.py has the documentation.

cimport cython

from epicycle.runner.execution.results.record cimport RecordHash

cdef Py_ssize_t _MANY


cdef class Writer:
    cdef public EventLog log
    cdef public tuple names
    cdef public bytes _number
    cdef public object _keep
    @cython.locals(hashed=RecordHash)
    cpdef write(self, when, value)


cdef class EventLog:
    cdef public RecordHash hash
    cdef public object records
    cdef public object crowd, _keeps, _log_to
    cdef public dict _writers
    cpdef report(self, when, port)
