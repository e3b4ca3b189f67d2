# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
"""Native forms: the busiest actors of the library in C.

A form fires in the place of its actor, and works on what the actor holds, so that nothing has to be brought back and
forth: the actor can be looked at and copied at any time.  It is chosen where an actor is of exactly that class, its
sends go straight into the log, nothing changes its parameters, and the run's own director fires it.
"""

import os

from cpython.float cimport PyFloat_FromDouble

from epicycle.actors cimport InputPort, Line, ParameterPort, Wake, nanoseconds_of, seconds_of
from epicycle.runner.engine.agenda cimport Turn
from epicycle.runner.engine.director cimport Director
from epicycle.runner.engine.native cimport (
    Drawing, Native, count_of, drawing_of, tokens_of,
)
from epicycle.runner.engine.way cimport Sender

from epicycle.actors import (
    Clock, Constant, Exponential, Gamma, Merge, PoissonClock, Queue, Random, Recorder, Server, TimeDelay,
)
from epicycle.runner.engine import computing


cdef class DelayForm(Native):
    __slots__ = ("actor", "delay", "director", "input", "line", "output", "turn")
    cdef public InputPort input
    cdef public Sender output
    cdef public Line line
    cdef public long long delay

    cdef bint take(self) except -1:
        if self.actor.steps:
            return False
        self.input, self.output = self.input_port("input"), self.sender("output")
        self.line = self.actor._held._line
        self.delay = nanoseconds_of(self.actor.delay)
        return self.output is not None

    cpdef fire(self):
        cdef Py_ssize_t place
        cdef list tokens
        while self.is_due(self.line):
            self.output.go(self.line.pop())
        tokens = tokens_of(self.input)
        for place in range(len(tokens)):
            self.keep(self.line, self.now() + self.delay, tokens[place])


cdef class Ticking(Native):
    """What the forms of clocks share."""

    cdef public Sender output
    cdef public object values
    cdef public long long stop

    cdef bint take(self) except -1:
        self.output = self.sender("output")
        values = self.actor.values
        if values is not None and type(values) not in (list, tuple):
            return False
        self.values = None if values is None else list(values)
        self.stop = 2**63 - 1 if self.actor.stop_time is None else nanoseconds_of(self.actor.stop_time)
        return self.output is not None

    cdef int send(self, tick) except -1:
        self.output.go(tick if self.values is None else self.values[<long long>tick % len(self.values)])
        return 0


cdef class ClockForm(Ticking):
    __slots__ = ("actor", "director", "offsets", "output", "period", "stop", "turn", "values")
    cdef public list offsets
    cdef public long long period

    cdef bint take(self) except -1:
        actor = self.actor
        if actor.start.width or actor.stop.width or actor.trigger.width or not Ticking.take(self):
            return False
        if actor.cycles is not None or actor.period == float("inf"):
            return False
        self.period = nanoseconds_of(self.actor.period)
        self.offsets = self.actor._offsets
        return True

    cpdef fire(self):
        cdef Wake wake = self.actor._wake
        cdef long long tick, cycle, following
        cdef Py_ssize_t count = len(self.offsets)
        if wake is None or not wake.due:
            return
        number = self.actor._tick
        self.send(number)
        tick = number + 1
        self.actor._tick = tick
        cycle = self.actor._cycle
        if tick % count == 0:
            cycle += self.period
            self.actor._cycle = cycle
        following = cycle + <long long>self.offsets[tick % count]
        self.actor._wake = None if following > self.stop else self.wake_at(following)


cdef class PoissonForm(Ticking):
    __slots__ = ("actor", "director", "drawing", "output", "stop", "turn", "values")
    cdef public Drawing drawing

    cdef bint take(self) except -1:
        self.drawing = drawing_of(Exponential(mean=self.actor.mean_interval), self.actor.random)
        if self.actor.one_at_a_time and self.actor.stop_time is not None:
            return False
        return self.actor.generator is None and not self.actor.trigger.width and Ticking.take(self)

    cpdef fire(self):
        cdef long long following
        tick = self.actor._tick
        self.send(tick)
        self.actor._tick = tick + 1
        following = self.now() + nanoseconds_of(self.drawing.next())
        if following <= self.stop:  # nobody calls it off, so that it needs no wake-up
            self.director.want_at(self.turn, following)


cdef class ServerForm(Native):
    __slots__ = (
        "actor", "capacity", "director", "drawing", "input", "line", "output", "rejected", "servers", "size", "time",
        "turn", "waiting",
    )
    varying = ("service_time",)
    cdef public InputPort input
    cdef public Sender output, size, rejected
    cdef public Line line
    cdef public Drawing drawing  # None if Python draws, or times come by themselves
    cdef public object waiting
    cdef public ParameterPort time  # where they come
    cdef public long long capacity, servers

    cdef bint take(self) except -1:
        actor = self.actor
        if actor.one_at_a_time:
            return False
        self.input, self.output = self.input_port("input"), self.sender("output")
        self.size, self.rejected = self.sender("size"), self.sender("rejected")
        self.line, self.waiting = actor._served._line, actor._waiting
        self.capacity = 2**62 if actor.capacity is None else min(actor.capacity, 2**62)
        self.servers = 2**62 if actor.servers is None else min(actor.servers, 2**62)
        if type(actor.distribution) in (Exponential, Gamma):  # which give nothing below 0
            self.drawing = drawing_of(actor.distribution, actor.random)
        elif actor.distribution is None and actor.inputs["service_time"].width:
            self.time = actor.inputs["service_time"]
        elif actor.distribution is None:
            self.drawing = drawing_of(Constant(value=actor.service_time), None)
        return self.output is not None and self.size is not None and self.rejected is not None

    cpdef fire(self):
        cdef long long size = self.line.size + len(self.waiting)
        cdef Py_ssize_t place
        cdef list tokens
        cdef double time
        while self.is_due(self.line):
            token, rest = self.line.pop()
            size -= 1
            self.actor._size = size
            self.output.go(token)
            self.size.go(size)
            if self.waiting:
                token, time = self.waiting.popleft()
                self.serve(token, time + <double>rest)
        tokens = tokens_of(self.input)
        for place in range(len(tokens)):
            token = tokens[place]
            if size >= self.capacity:
                self.rejected.go(token)
                continue
            time = self.draw()
            if self.line.size < self.servers:
                self.serve(token, time)
            else:
                self.waiting.append((token, time))
            size += 1
            self.actor._size = size
            self.size.go(size)

    cdef int serve(self, token, double time) except -1:
        cdef long long nanoseconds = nanoseconds_of(time)
        cdef double rest = time - seconds_of(nanoseconds)
        self.keep(self.line, self.now() + nanoseconds, (token, rest))
        return 0

    cdef double draw(self) except? -1.0:
        if self.drawing is not None:
            return self.drawing.next()
        token = None if self.time is None else self.time._received
        if type(token) is not float or not <double>token >= 0.0:
            return self.actor._draw()
        self.time.settle(token)
        return token


cdef class RandomForm(Native):
    __slots__ = ("actor", "director", "drawing", "output", "stream", "trigger", "turn")
    cdef public InputPort trigger
    cdef public Sender output
    cdef public Drawing drawing
    cdef public object stream

    cdef bint take(self) except -1:
        self.trigger, self.output, self.stream = self.input_port("trigger"), self.sender("output"), self.actor.random
        self.drawing = drawing_of(self.actor.distribution, self.stream)
        return self.output is not None and self.trigger.width == 1 and self.actor.generator is None

    cpdef fire(self):
        for _ in range(count_of(self.trigger)):
            if self.drawing is None:
                self.output.go(self.actor.distribution.draw(self.stream))
            else:
                self.output.go(PyFloat_FromDouble(self.drawing.next()))


cdef class MergeForm(Native):
    __slots__ = ("actor", "director", "discards", "input", "output", "turn", "waiting")
    cdef public InputPort input
    cdef public Sender output
    cdef public list waiting
    cdef public bint discards

    cdef bint take(self) except -1:
        self.input, self.output = self.input_port("input"), self.sender("output")
        self.waiting, self.discards = self.actor._waiting, self.actor.discard
        return self.output is not None and not self.actor.whole_channel

    cpdef fire(self):
        cdef list tokens = tokens_of(self.input)
        cdef Py_ssize_t place
        first = None
        for place in range(len(tokens)):
            self.waiting[self.input.channels[place] if self.input.width > 1 else 0].append(tokens[place])
        for queue in self.waiting:
            if not queue:
                continue
            if first is None:
                first = queue
                self.output.go(queue.popleft())
            if self.discards:
                queue.clear()
            elif queue:
                self.wake_at(self.now())
                return


cdef class QueueForm(Native):
    __slots__ = (
        "actor", "capacity", "director", "input", "output", "persists", "rejected", "size", "trigger", "turn", "waiting",
    )
    cdef public InputPort input, trigger
    cdef public Sender output, size, rejected
    cdef public object waiting
    cdef public long long capacity
    cdef public bint persists

    cdef bint take(self) except -1:
        actor = self.actor
        if actor.one_at_a_time:
            return False
        self.input, self.trigger, self.output = self.input_port("input"), self.input_port("trigger"), self.sender("output")
        self.size, self.rejected = self.sender("size"), self.sender("rejected")
        self.waiting, self.persists = actor._tokens, actor.persistent_trigger
        self.capacity = 2**62 if actor.capacity is None else min(actor.capacity, 2**62)
        return self.output is not None and self.size is not None and self.rejected is not None

    cpdef fire(self):
        cdef list tokens = tokens_of(self.input)
        cdef Py_ssize_t place
        cdef long long triggers
        for place in range(len(tokens)):
            if <long long>len(self.waiting) >= self.capacity:
                self.rejected.go(tokens[place])
            else:
                self.waiting.append(tokens[place])
                self.size.go(len(self.waiting))
        triggers = self.actor._triggers
        triggers += count_of(self.trigger)
        self.actor._triggers = triggers
        while triggers and self.waiting:
            triggers -= 1
            self.actor._triggers = triggers
            self.output.go(self.waiting.popleft())
            self.size.go(len(self.waiting))
        if not self.persists:
            self.actor._triggers = 0


cdef class RecorderForm(Native):
    __slots__ = ("actor", "capacity", "director", "input", "turn")
    cdef public InputPort input
    cdef public object capacity

    cdef bint take(self) except -1:
        self.input = self.input_port("input")
        self.capacity = self.actor.capacity
        return True

    cpdef fire(self):
        cdef list tokens = tokens_of(self.input)
        self.actor.seen += len(tokens)
        if self.capacity == 0:
            return
        self.actor.tokens.extend(tokens)
        self.actor.tags.extend([self.director.present.tag] * len(tokens))
        if self.capacity is not None and len(self.actor.tokens) > self.capacity:
            surplus = len(self.actor.tokens) - self.capacity
            del self.actor.tokens[:surplus], self.actor.tags[:surplus]


# What the forms are forms of, with digests of the sources: where one has changed, nothing is built.
SOURCES = (
    ("accumulation.py", "Counter", "c2dfe0cdd9e65d96"),
    ("accumulation.py", "Integrator", "b7ff4d62fa85e9f9"),
    ("arithmetic.py", "AddSubtract", "ab43489dd015746a"),
    ("distributions.py", "Constant", "e6f123317132cd9d"),
    ("distributions.py", "Gamma", "a02963690b8f422f"),
    ("distributions.py", "Normal", "41b7f712051a423b"),
    ("distributions.py", "Uniform", "6d1f653751253aab"),
    ("flow.py", "Merge", "8660e6060412c03d"),
    ("functions.py", "Expression", "626b064f18a71310"),
    ("queues.py", "Queue", "f18d7dec94a8737f"),
    ("sources.py", "Random", "56144986a1aa3492"),
    ("core/authoring.py", "Latest", "b022c8dea367d216"),
    ("core/authoring.py", "rounds", "bcf677d00b681776"),
    ("core/laws.py", "gamma", "da1afffdbd29a311"),
    ("core/laws.py", "normal", "c6bfa77a937cc231"),
    ("core/laws.py", "uniform", "36b3b17c5a3d5e40"),
    ("core/port_parameter.py", "ParameterPort", "8a9a3fc4f574c08e"),
    ("core/elementary/sums.py", "total", "dc84358727c0bc10"),
    ("distributions.py", "Exponential", "6237f8b673097710"),
    ("queues.py", "Server", "40505ceac74b629d"),
    ("sinks.py", "Recorder", "ad4d11e84ae6d26d"),
    ("sources.py", "Clock", "72b20d3d884177d4"),
    ("sources.py", "PoissonClock", "87a89c8375357743"),
    ("sources.py", "_Ticking", "58ace3f1608226e9"),
    ("arithmetic.py", "Scale", "922140efa4b006ed"),
    ("timing.py", "TimeDelay", "e59a08ff7bcd6e9f"),
    ("core/elementary/logarithm.py", "log", "25dc7d4323f94b34"),
    ("core/laws.py", "exponential", "dd3e701d840f2744"),
    ("core/tag.py", "to_nanoseconds", "92eec895841c04b6"),
    ("core/tag.py", "to_seconds", "f6c6aae6371c52a3"),
    ("core/authoring.py", "Pending", "faf6cabccebf5d58"),
)
FORMS = {
    **computing.FORMS,
    Clock: ClockForm,
    Merge: MergeForm,
    PoissonClock: PoissonForm,
    Queue: QueueForm,
    Random: RandomForm,
    Recorder: RecorderForm,
    Server: ServerForm,
    TimeDelay: DelayForm,
}
FIRE = {kind: kind.fire for kind in FORMS}  # of which each is the form, and of no other that takes its place


def attach(director, actors, besides):
    """Let forms fire in the place of those actors that have one, besides some; how many do."""
    cdef Native form
    if type(director) is not Director or os.environ.get("EPICYCLE_FORMS") == "off":
        return 0
    count = 0
    for path, actor in actors.items():
        kind = FORMS.get(type(actor))
        if kind is None or path in besides or getattr(actor.fire, "__func__", None) is not FIRE[type(actor)]:
            continue
        inputs = list(actor.inputs.values())
        varying = {each.name for each in inputs if type(each) is not InputPort and each.width}
        if any(each.keep for each in inputs):
            continue
        if actor.context is not director or not varying.issubset(getattr(kind, "varying", ())):
            continue
        form = kind()
        form.actor, form.director = actor, director
        form.turn = director.turn(actor, director.ranks[path])
        try:
            if not form.take():
                continue
        except Exception:  # as soon as it fires, the actor says what is wrong
            continue
        for rank in {director.ranks[path], *(director.ranks[each.path] for each in inputs if each.width)}:
            (<Turn>director.turn(actor, rank)).form = form
        count += 1
    return count
