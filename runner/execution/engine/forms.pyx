# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
"""Native forms: the busiest actors of the library in C.

A form fires in the place of its actor, and works on what the actor holds, so that nothing has to be brought back and
forth: the actor can be looked at and copied at any time.  It is chosen where an actor is of exactly that class, its
sends go straight into the log, nothing changes its parameters, and the run's own director fires it.
``tests/engine/test_forms.py`` says of which sources these are the forms.
"""

import os

from cpython.float cimport PyFloat_FromDouble

from epicycle.actors cimport InputPort, TimedQueue, ParameterPort, Wake, nanoseconds_of, seconds_of
from epicycle.actors.core.laws cimport standard_exponential, standard_gamma, standard_normal
from epicycle.actors.core.primitives cimport Words
from epicycle.runner.execution.engine.agenda cimport Form, Instant, Activation
from epicycle.runner.execution.engine.director cimport Director
from epicycle.runner.execution.engine.receivers cimport Sender

from epicycle.actors import (
    Clock, Constant, Expression, Exponential, Gamma, Normal, PoissonClock, Random, Scale, Server, TimeDelay, Uniform,
)
from epicycle.actors.expression import UNDECIDED


cdef enum:
    CONSTANT, EXPONENTIAL, GAMMA, NORMAL, UNIFORM


cdef class Drawing:
    """A law of numbers, with its parameters and the stream that it draws from."""

    __slots__ = ("first", "law", "second", "stream")
    cdef public int law
    cdef public double first, second
    cdef public Words stream

    cdef double next(self) except? -1.0:
        if self.law == EXPONENTIAL:
            return self.first * standard_exponential(self.stream)
        if self.law == GAMMA:
            return self.second * standard_gamma(self.stream, self.first)
        if self.law == NORMAL:
            return self.first + self.second * standard_normal(self.stream)
        if self.law == UNIFORM:
            return self.first + (self.second - self.first) * ((self.stream.word() >> 11) * (0.5 / 4503599627370496.0))
        return self.first


cdef Drawing drawing(int law, stream, double first, double second=0.0):
    """What draws from a law."""
    cdef Drawing made = Drawing()
    made.law, made.stream, made.first, made.second = law, stream, first, second
    return made


cdef Drawing drawing_of(distribution, stream):
    """What draws from a distribution; None if that is left to Python."""
    kind = type(distribution)
    if kind is Constant:
        return drawing(CONSTANT, stream, distribution.value)
    if kind is Exponential:
        return drawing(EXPONENTIAL, stream, distribution.mean)
    if kind is Gamma:
        return drawing(GAMMA, stream, distribution.shape, distribution.mean / distribution.shape)
    if kind is Normal:
        return drawing(NORMAL, stream, distribution.mean, distribution.standard_deviation)
    if kind is Uniform:
        return drawing(UNIFORM, stream, distribution.low, distribution.high)
    return None


cdef class Native(Form):
    """What the forms share: where an actor stands in the run, and who takes what it sends."""

    cdef public object actor
    cdef public Director director
    cdef public Activation activation

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
        return self.director.wake_activation(self.activation, time)

    cdef int keep(self, TimedQueue line, long long time, value) except -1:
        """Let a value wait for its time; who fires it cannot call off, and so needs no wake-up that says so."""
        cdef Instant instant = self.director.schedule_at(self.activation, time)
        line.put(instant.time, instant.microstep, None, value)
        return 0

    cdef bint is_due(self, TimedQueue line):
        cdef Instant now = self.director.present
        return line.is_before(now.time, now.microstep)


cdef inline list tokens_of(InputPort port):
    """The tokens of the present tag."""
    return port.shown


cdef inline Py_ssize_t count_of(InputPort port):
    """How many there are."""
    return len(port.shown)


cdef inline bint all_floats(list tokens):
    """Whether all are floats and nothing else: whole numbers have arithmetic of their own."""
    cdef Py_ssize_t place
    for place in range(len(tokens)):
        if type(tokens[place]) is not float:
            return False
    return True


cdef class DelayForm(Native):
    __slots__ = ("actor", "delay", "director", "input", "line", "output", "activation")
    cdef public InputPort input
    cdef public Sender output
    cdef public TimedQueue line
    cdef public long long delay

    cdef bint take(self) except -1:
        self.input, self.output = self.input_port("input"), self.sender("output")
        self.line = self.actor._held._line
        self.delay = nanoseconds_of(self.actor.delay)
        return self.output is not None

    cpdef fire(self):
        cdef Py_ssize_t place
        cdef list tokens
        while self.is_due(self.line):
            self.output.put(self.line.pop())
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
        self.output.put(tick if self.values is None else self.values[<long long>tick % len(self.values)])
        return 0


cdef class ClockForm(Ticking):
    __slots__ = ("actor", "director", "offsets", "output", "period", "stop", "activation", "values")
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
    __slots__ = ("actor", "director", "drawing", "output", "stop", "activation", "values")
    cdef public Drawing drawing

    cdef bint take(self) except -1:
        self.drawing = drawing(EXPONENTIAL, self.actor.random, self.actor.mean_interval)
        return not self.actor.trigger.width and Ticking.take(self)

    cpdef fire(self):
        cdef long long following
        tick = self.actor._tick
        self.send(tick)
        self.actor._tick = tick + 1
        following = self.now() + nanoseconds_of(self.drawing.next())
        if following <= self.stop:  # nobody calls it off, so that it needs no wake-up
            self.director.schedule_at(self.activation, following)


cdef class ServerForm(Native):
    __slots__ = (
        "actor", "capacity", "director", "drawing", "input", "line", "output", "rejected", "servers", "size", "time",
        "activation", "waiting",
    )
    varying = ("service_time",)
    cdef public InputPort input
    cdef public Sender output, size, rejected
    cdef public TimedQueue line
    cdef public Drawing drawing  # None if Python draws, or times come by themselves
    cdef public object waiting
    cdef public ParameterPort time  # where they come
    cdef public long long capacity, servers

    cdef bint take(self) except -1:
        actor = self.actor
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
            self.drawing = drawing(CONSTANT, None, actor.service_time)
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
            self.output.put(token)
            self.size.put(size)
            if self.waiting:
                token, time = self.waiting.popleft()
                self.serve(token, time + <double>rest)
        tokens = tokens_of(self.input)
        for place in range(len(tokens)):
            token = tokens[place]
            if size >= self.capacity:
                self.rejected.put(token)
                continue
            time = self.draw()
            if self.line.size < self.servers:
                self.serve(token, time)
            else:
                self.waiting.append((token, time))
            size += 1
            self.actor._size = size
            self.size.put(size)

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
            return self.actor.draw_time()
        self.time.settle(token)
        return token


cdef class RandomForm(Native):
    __slots__ = ("actor", "director", "drawing", "output", "stream", "trigger", "activation")
    cdef public InputPort trigger
    cdef public Sender output
    cdef public Drawing drawing
    cdef public object stream

    cdef bint take(self) except -1:
        self.trigger, self.output, self.stream = self.input_port("trigger"), self.sender("output"), self.actor.random
        self.drawing = drawing_of(self.actor.distribution, self.stream)
        return self.output is not None and self.trigger.width == 1

    cpdef fire(self):
        for _ in range(count_of(self.trigger)):
            if self.drawing is None:
                self.output.put(self.actor.distribution.draw(self.stream))
            else:
                self.output.put(PyFloat_FromDouble(self.drawing.next()))


cdef class ScaleForm(Native):
    __slots__ = ("actor", "director", "input", "number", "offset_number", "output", "activation")
    cdef public InputPort input
    cdef public Sender output
    cdef public double number, offset_number

    cdef bint take(self) except -1:
        self.input, self.output = self.input_port("input"), self.sender("output")
        self.number, self.offset_number = self.actor.factor, self.actor.offset
        return self.output is not None

    cpdef fire(self):
        cdef list tokens = tokens_of(self.input)
        cdef Py_ssize_t place
        if not all_floats(tokens):
            self.actor.fire()
            return
        for place in range(len(tokens)):
            self.output.put(PyFloat_FromDouble(self.number * <double>tokens[place] + self.offset_number))


cdef class ExpressionForm(Native):
    __slots__ = ("actor", "director", "function", "holds", "inputs", "latest", "names", "output", "ports", "activation", "wants_number")
    cdef public list ports, inputs, names  # ports, what they are called, and the names of the expression
    cdef public Sender output
    cdef public dict latest
    cdef public object function
    cdef public bint holds, wants_number

    cdef bint take(self) except -1:
        actor = self.actor
        self.ports, self.names = actor._latest._ports, list(actor.expression.names)
        self.inputs = [port.name for port in self.ports]
        self.output, self.latest, self.holds = self.sender("output"), actor._latest._tokens, actor.hold
        self.function, self.wants_number = actor.expression.function, actor._kind in ("number", "any value")
        is_whole = {"time", *self.inputs}.issuperset(self.names)
        return self.output is not None and is_whole

    cpdef fire(self):
        cdef InputPort port
        cdef bint has_come = False
        cdef Py_ssize_t place
        cdef list given = []
        for port in self.ports:
            if count_of(port) > 1:  # of which each has a round of its own
                self.actor.fire()
                return
        if not self.holds:
            self.latest.clear()
        for place in range(len(self.ports)):
            port = self.ports[place]
            if count_of(port):
                self.latest[self.inputs[place]] = tokens_of(port)[0]
                has_come = True
        if not has_come or len(self.latest) < len(self.ports):
            return
        for name in self.names:
            given.append(PyFloat_FromDouble(seconds_of(self.now())) if name == "time" else self.latest[name])
        try:
            value = self.function(*given)
        except UNDECIDED:
            value = self.actor._value(dict(self.latest))
        else:
            if type(value) is not float or not self.wants_number:
                value = self.actor._checked(value)
        self.output.put(value)


FORMS = {
    Clock: ClockForm,
    Expression: ExpressionForm,
    PoissonClock: PoissonForm,
    Random: RandomForm,
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
        if kind is None or path in besides or getattr(actor.fire, "__func__", None) is not FIRE[type(actor)]:
            continue
        inputs = list(actor.inputs.values())
        varying = {each.name for each in inputs if type(each) is not InputPort and each.width}
        if actor.context is not director or not varying.issubset(getattr(kind, "varying", ())):
            continue
        form = kind()
        form.actor, form.director = actor, director
        form.activation = director.activation(actor, director.ranks[path])
        try:
            if not form.take():
                continue
        except Exception:  # as soon as it fires, the actor says what is wrong
            continue
        for rank in {director.ranks[path], *(director.ranks[each.path] for each in inputs if each.width)}:
            (<Activation>director.activation(actor, rank)).form = form
        count += 1
    return count
