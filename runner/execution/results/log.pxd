# Types for C; log.py has the documentation.

from epicycle.runner.execution.results.record cimport RecordHash

cdef class EventLog:
    cdef public RecordHash hash
    cdef public object records
    cdef public object crowd, _keeps, _log_to
    cdef public dict _writers
    cpdef keep(self, when, tuple names, value)
    cpdef report(self, when, tuple names, number)
