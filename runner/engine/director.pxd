# Types for C; director.py has the documentation.

cimport cython
from epicycle.actors cimport InputPort, Moment, Ranks, Times, Wake, Way, new_wake
from epicycle.runner.engine.agenda cimport Delivery, Form, Instant, Turn, new_instant


cdef class Director:
    cdef public object _environment, seed, streams, crowd, ranks, watch, _stop_after, _reason
    cdef public list _queue, _recent, turns
    cdef public Ranks _ready
    cdef public Times _times
    cdef public long long firings, steps, _on_their_way, _most_times, _most_microsteps, _most_steps, _time
    cdef public long rank
    cdef public Instant present, _last, _next, _past
    cdef public bint _has_simpy, _is_interrupted
    @cython.locals(last=Instant, time=cython.longlong)
    cpdef Instant now(self)
    cpdef wake(self, actor, long long time)
    @cython.locals(now=Instant, instant=Instant)
    cpdef Wake wake_turn(self, Turn turn, long long time)
    @cython.locals(turn=Turn, now=Instant)
    cpdef call(self, actor, tag, long rank)
    @cython.locals(now=Instant, instant=Instant)
    cpdef Instant want_at(self, Turn turn, long long time)
    @cython.locals(wake=Wake)
    cpdef Wake _call_now(self, Turn turn, Instant now)
    @cython.locals(wake=Wake)
    cpdef Wake _wake_at(self, Turn turn, Instant instant)
    cpdef Turn turn(self, actor, long rank)
    @cython.locals(turn=Turn)
    cpdef Turn new_turn(self, actor, long rank)
    @cython.locals(now=Instant, instant=Instant)
    cpdef later(self, long long delay, way, token)
    cpdef Delivery hold(self, way, token)
    cpdef want(self, Turn turn)
    @cython.locals(instant=Instant)
    cpdef Instant _to_come(self, Instant now, long long time)
    @cython.locals(now=Instant)
    cpdef _await_present(self)
    @cython.locals(instant=Instant, past=Instant)
    cpdef Instant _await(self, long long time, long microstep)
    cpdef line_up(self, Turn turn)
    @cython.locals(turn=Turn)
    cpdef Turn next_turn(self)
    cpdef bint has_reason(self, Turn turn) except -1
    @cython.locals(turn=Turn, delivery=Delivery, place=cython.Py_ssize_t)
    cpdef handle(self, Instant instant)
    cpdef _wake_up(self, Turn turn, Wake wake)
    cpdef _begin(self, Instant instant)
    cpdef bint use_wakes(self, Turn turn) except -1
    cpdef fire(self, Turn turn)


cdef class Entry(Way):
    cdef public Director director
    cdef public Turn turn
    cdef public InputPort port
    cdef public object channel
    cdef public bint is_plain
    @cython.locals(turn=Turn)
    cpdef go(self, token)
