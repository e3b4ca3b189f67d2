# Types for C; listeners.py has the documentation.

cimport cython
from epicycle.actors cimport Receiver
from epicycle.runner.execution.engine.agenda cimport Instant
from epicycle.runner.execution.engine.director cimport Director
from epicycle.runner.execution.engine.measurement cimport Measurement
from epicycle.runner.execution.results cimport Samples


cdef class Recording(Receiver):
    cdef public Samples samples
    cdef public Director director
    @cython.locals(now=Instant)
    cpdef put(self, token)


cdef class Measuring(Receiver):
    cdef public Measurement measurement
    cdef public str port
    cdef public Director director
    @cython.locals(now=Instant)
    cpdef put(self, token)
