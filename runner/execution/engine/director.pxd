# Types for C; director.py has the documentation.

cimport cython
from epicycle.actors cimport InputPort, Moment, ReadyQueue, TimedQueue, Wake, Receiver, new_wake
from epicycle.runner.execution.engine.agenda cimport Delivery, Form, Instant, Activation, new_instant


cdef class Director:
    cdef public object _environment, events, seed, streams, crowd, ranks, watch, _stop_after, _reason
    cdef public list _recent, activations
    cdef public ReadyQueue _ready
    cdef public TimedQueue _times
    cdef public long long firings, steps, _on_their_way, _most_times, _most_microsteps, _most_steps, _time
    cdef public long rank
    cdef public Instant present, _last, _latest, _next, _past
    cdef public bint _is_interrupted, is_plain
    @cython.locals(last=Instant, time=cython.longlong)
    cpdef Instant now(self)
    cpdef wake(self, actor, long long time)
    @cython.locals(now=Instant)
    cpdef Wake wake_activation(self, Activation activation, long long time)
    @cython.locals(activation=Activation, now=Instant)
    cpdef call(self, actor, tag, long rank)
    @cython.locals(now=Instant, instant=Instant)
    cpdef Instant schedule_at(self, Activation activation, long long time)
    @cython.locals(wake=Wake)
    cpdef Wake _call_now(self, Activation activation, Instant now)
    @cython.locals(wake=Wake)
    cpdef Wake _wake_at(self, Activation activation, Instant instant)
    cpdef Activation activation(self, actor, long rank)
    @cython.locals(activation=Activation)
    cpdef Activation new_activation(self, actor, long rank)
    @cython.locals(now=Instant, instant=Instant)
    cpdef later(self, long long delay, way, token)
    cpdef Delivery hold(self, way, token)
    cpdef schedule(self, Activation activation)
    @cython.locals(latest=Instant)
    cpdef Instant _to_come(self, Instant now, long long time)
    @cython.locals(now=Instant)
    cpdef _await_present(self)
    @cython.locals(instant=Instant, past=Instant)
    cpdef Instant _await(self, long long time, long microstep)
    @cython.locals(instant=Instant, latest=Instant)
    cpdef Instant take(self)
    cpdef enqueue(self, Activation activation)
    @cython.locals(activation=Activation, rank=cython.long)
    cpdef Activation next_activation(self)
    cpdef bint has_reason(self, Activation activation) except -1
    @cython.locals(
        activation=Activation, delivery=Delivery, place=cython.Py_ssize_t, ready=ReadyQueue, rank=cython.long,
        is_plain=cython.bint,
    )
    cpdef handle(self, Instant instant)
    cpdef _wake_up(self, Activation activation, Wake wake)
    cpdef _begin(self, Instant instant)
    cpdef bint use_wakes(self, Activation activation) except -1
    cpdef fire(self, Activation activation)


cdef class Entry(Receiver):
    cdef public Director director
    cdef public Activation activation
    cdef public InputPort port
    cdef public object channel
    cdef public bint is_plain
    @cython.locals(activation=Activation, director=Director)
    cpdef put(self, token)
