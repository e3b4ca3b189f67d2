# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
"""Native forms: the busiest actors of the library in C.

A form fires in the place of its actor, and works on what the actor holds, so that nothing has to be brought back and
forth: the actor can be looked at and copied at any time.  It is chosen where an actor is of exactly that class, its
sends go straight into the log, nothing changes its parameters, and the run's own director fires it.
"""

import os

from cpython.float cimport PyFloat_FromDouble
from libc.math cimport frexp, rint
from libc.stdint cimport uint64_t

from epicycle.actors cimport InputPort, Line, Wake
from epicycle.runner.engine.agenda cimport Form, Instant, Turn
from epicycle.runner.engine.director cimport Director
from epicycle.runner.engine.way cimport Sender

from epicycle.actors import Clock, Exponential, PoissonClock, Recorder, Scale, Server, TimeDelay
from epicycle.actors import to_nanoseconds as exactly_to_nanoseconds
from epicycle.actors import to_seconds as exactly_to_seconds
from epicycle.actors.core.elementary import log as far_log
from epicycle.actors.core.elementary import tables

cdef double LATEST = 2.0 ** 62
cdef long long EXACT = 2 ** 53
cdef double INVERSES[1024]
cdef double LOG_HIGH[1024]
cdef double LOG_LOW[1024]
cdef double LN_2_HIGH = tables.LN_2_HIGH
cdef double LN_2_LOW = tables.LN_2_LOW
cdef int entry
for entry in range(len(tables.INVERSES)):
    INVERSES[entry] = tables.INVERSES[entry]
    LOG_HIGH[entry] = tables.LOG_HIGH[entry]
    LOG_LOW[entry] = tables.LOG_LOW[entry]


cdef long long to_nanoseconds(double seconds) except? -1:
    cdef double nanoseconds = seconds * 1e9
    if not -LATEST <= nanoseconds <= LATEST:
        exactly_to_nanoseconds(seconds)  # which says what is wrong
    return <long long>rint(nanoseconds)


cdef double to_seconds(long long nanoseconds) except? -1.0:
    return nanoseconds / 1e9 if -EXACT < nanoseconds < EXACT else exactly_to_seconds(nanoseconds)


cdef double logarithm(double x) except? -1.0:
    """As ``elementary.log``, operation by operation."""
    cdef int e, i
    cdef double m, point, inverse, r, bent, start, first, rest
    if not 0.0 < x < 1e300:
        return far_log(x)
    m = frexp(x, &e)
    i = <int>(m * 512.0 + 0.5)
    point = i * 0.001953125
    inverse = INVERSES[i]
    r = (m - point) * inverse
    bent = r * r * (0.5 - r * (0.3333333333333333 - r * (0.25 - r * (0.2 - r * 0.16666666666666666))))
    start = e * LN_2_HIGH + LOG_HIGH[i]
    if start == 0.0:
        return r - bent
    first = (r + 393216.0) - 393216.0
    rest = ((m - point) - first * point) * inverse
    return (start + first) + (rest + ((e * LN_2_LOW + LOG_LOW[i]) - bent))


cdef double exponential(stream, double scale) except? -1.0:
    """As ``laws.exponential`` draws it."""
    cdef list ahead = stream._ahead
    cdef uint64_t word = ahead.pop() if ahead else stream.word()
    return scale * -logarithm(1.0 - (<double>(word >> 12) + 0.5) * (1.0 / 4503599627370496.0))


cdef class Native(Form):
    """What the forms share: where an actor stands in the run, and who takes what it sends."""

    cdef public object actor
    cdef public Director director
    cdef public Turn turn

    cdef bint take(self) except -1:
        """Get hold of what the actor holds; whether it can have a form."""
        return True

    cdef Sender sender(self, name):
        emitter = self.actor.outputs[name].emitter
        return emitter if type(emitter) is Sender else None

    cdef InputPort input_port(self, name):
        return self.actor.inputs[name]

    cdef long long now(self):
        return self.director.present.time

    cdef Wake wake_at(self, long long time):
        return self.director.wake_turn(self.turn, time)

    cdef int keep(self, Line line, long long time, value) except -1:
        """Let a value wait for its time; who fires it cannot call off, and so needs no wake-up that says so."""
        cdef Instant instant = self.director.want_at(self.turn, time)
        line.put(instant.time, instant.microstep, None, value)
        return 0

    cdef bint is_due(self, Line line):
        cdef Instant now = self.director.present
        return line.is_before(now.time, now.microstep)


cdef class DelayForm(Native):
    __slots__ = ("actor", "delay", "director", "input", "line", "output", "turn")
    cdef public InputPort input
    cdef public Sender output
    cdef public Line line
    cdef public long long delay

    cdef bint take(self) except -1:
        self.input, self.output = self.input_port("input"), self.sender("output")
        self.line = self.actor._held._line
        self.delay = to_nanoseconds(self.actor.delay)
        return self.output is not None

    cpdef fire(self):
        cdef Py_ssize_t place
        cdef list tokens
        while self.is_due(self.line):
            self.output.go(self.line.pop())
        tokens = self.input.shown
        for place in range(len(tokens)):
            self.keep(self.line, self.now() + self.delay, tokens[place])


cdef class ScaleForm(Native):
    __slots__ = ("actor", "director", "input", "number", "offset_number", "output", "turn")
    cdef public InputPort input
    cdef public Sender output
    cdef public double number, offset_number

    cdef bint take(self) except -1:
        self.input, self.output = self.input_port("input"), self.sender("output")
        self.number, self.offset_number = self.actor.factor, self.actor.offset
        return self.output is not None

    cpdef fire(self):
        cdef list tokens = self.input.shown
        cdef Py_ssize_t place
        for place in range(len(tokens)):
            if type(tokens[place]) is not float:  # whole numbers have arithmetic of their own
                self.actor.fire()
                return
        for place in range(len(tokens)):
            self.output.go(PyFloat_FromDouble(self.number * <double>tokens[place] + self.offset_number))


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
        self.stop = 2**63 - 1 if self.actor.stop_time is None else to_nanoseconds(self.actor.stop_time)
        return self.output is not None

    cdef int send(self, long long tick) except -1:
        self.output.go(tick if self.values is None else self.values[tick % len(self.values)])
        return 0

    cdef Wake again_at(self, long long time):
        return None if time > self.stop else self.wake_at(time)


cdef class ClockForm(Ticking):
    __slots__ = ("actor", "director", "offsets", "output", "period", "stop", "turn", "values")
    cdef public list offsets
    cdef public long long period

    cdef bint take(self) except -1:
        if self.actor.start.width or self.actor.stop.width or not Ticking.take(self):
            return False
        self.period = to_nanoseconds(self.actor.period)
        self.offsets = self.actor._offsets
        return True

    cpdef fire(self):
        cdef Wake wake = self.actor._wake
        cdef long long tick, cycle
        cdef Py_ssize_t count = len(self.offsets)
        if wake is None or not wake.due:
            return
        tick = self.actor._tick
        self.send(tick)
        tick += 1
        self.actor._tick = tick
        cycle = self.actor._cycle
        if tick % count == 0:
            cycle += self.period
            self.actor._cycle = cycle
        self.actor._wake = self.again_at(cycle + <long long>self.offsets[tick % count])


cdef class PoissonForm(Ticking):
    __slots__ = ("actor", "director", "mean", "output", "stop", "stream", "turn", "values")
    cdef public double mean
    cdef public object stream

    cdef bint take(self) except -1:
        self.mean = self.actor.mean_interval
        self.stream = self.actor.random
        return Ticking.take(self)

    cpdef fire(self):
        cdef long long tick = self.actor._tick
        self.send(tick)
        self.actor._tick = tick + 1
        self.again_at(self.now() + to_nanoseconds(exponential(self.stream, self.mean)))


cdef class ServerForm(Native):
    __slots__ = (
        "actor", "capacity", "director", "input", "line", "mean", "output", "rejected", "servers", "size", "stream",
        "turn", "waiting",
    )
    cdef public InputPort input
    cdef public Sender output, size, rejected
    cdef public Line line
    cdef public object waiting, stream
    cdef public long long capacity, servers
    cdef public double mean  # of exponential times; below 0 for others

    cdef bint take(self) except -1:
        actor = self.actor
        self.input, self.output = self.input_port("input"), self.sender("output")
        self.size, self.rejected = self.sender("size"), self.sender("rejected")
        self.line, self.waiting = actor._served._line, actor._waiting
        self.capacity = 2**62 if actor.capacity is None else min(actor.capacity, 2**62)
        self.servers = 2**62 if actor.servers is None else min(actor.servers, 2**62)
        self.mean = -1.0
        if type(actor.distribution) is Exponential:
            self.mean, self.stream = actor.distribution.mean, actor.random
        return self.output is not None and self.size is not None and self.rejected is not None

    cpdef fire(self):
        cdef long long size = self.actor._size
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
        tokens = self.input.shown
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
        cdef long long nanoseconds = to_nanoseconds(time)
        cdef double rest = time - to_seconds(nanoseconds)
        self.keep(self.line, self.now() + nanoseconds, (token, rest))
        return 0

    cdef double draw(self) except? -1.0:
        return exponential(self.stream, self.mean) if self.mean >= 0.0 else self.actor._draw()


cdef class RecorderForm(Native):
    __slots__ = ("actor", "capacity", "director", "input", "turn")
    cdef public InputPort input
    cdef public object capacity

    cdef bint take(self) except -1:
        self.input = self.input_port("input")
        self.capacity = self.actor.capacity
        return True

    cpdef fire(self):
        cdef list tokens = self.input.shown
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
    ("distributions.py", "Exponential", "f14ea8a70640a74a"),
    ("queues.py", "Server", "2445f4d1853973a9"),
    ("sinks.py", "Recorder", "7e5e225f348888c2"),
    ("sources.py", "Clock", "4ed40b10da22b8e9"),
    ("sources.py", "PoissonClock", "3d48035a29d3f078"),
    ("sources.py", "_Ticking", "3720b339ddf2994e"),
    ("arithmetic.py", "Scale", "3aafcbc1e5e5c3de"),
    ("timing.py", "TimeDelay", "b8778dbbc9a75614"),
    ("core/elementary/logarithm.py", "log", "25dc7d4323f94b34"),
    ("core/laws.py", "exponential", "dd3e701d840f2744"),
    ("core/tag.py", "to_nanoseconds", "150cad21f6cd87f7"),
    ("core/tag.py", "to_seconds", "f6c6aae6371c52a3"),
    ("core/authoring.py", "Pending", "faf6cabccebf5d58"),
)
FORMS = {
    Clock: ClockForm,
    PoissonClock: PoissonForm,
    Recorder: RecorderForm,
    Scale: ScaleForm,
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
        if kind is None or path in besides or type(actor).fire is not FIRE[type(actor)] or "fire" in vars(actor):
            continue
        inputs = list(actor.inputs.values())
        if actor.context is not director or any(type(each) is not InputPort and each.width for each in inputs):
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
