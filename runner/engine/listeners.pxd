# Types for C; listeners.py has the documentation.

cimport cython
from epicycle.actors cimport Way
from epicycle.runner.engine.agenda cimport Instant
from epicycle.runner.engine.director cimport Director
from epicycle.runner.engine.measurement cimport Measurement
from epicycle.runner.results cimport Samples


cdef class Recording(Way):
    cdef public Samples samples
    cdef public Director director
    @cython.locals(now=Instant)
    cpdef go(self, token)


cdef class Measuring(Way):
    cdef public Measurement measurement
    cdef public str port
    cdef public Director director
    @cython.locals(now=Instant)
    cpdef go(self, token)
