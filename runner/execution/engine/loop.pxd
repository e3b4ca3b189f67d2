# Types for C; loop.py has the documentation.

cimport cython
from epicycle.actors cimport TimedQueue
from epicycle.runner.execution.engine.agenda cimport Instant
from epicycle.runner.execution.engine.director cimport Director


cdef long long _NOTICED


@cython.locals(
    times=TimedQueue, instant=Instant, queue=list, is_of_simpy=cython.bint, here=cython.longlong, now=cython.longlong,
    upcoming=cython.longlong, last_time=cython.longlong, last_step=cython.longlong,
    never=cython.longlong,
)
cpdef handle_events(Director director, stop, list actors, progress=*, pace=*, most=*)
