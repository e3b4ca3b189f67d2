# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
"""What native forms are made of: times, draws, and where an actor stands in the run."""

from epicycle.actors.core.laws cimport standard_exponential, standard_gamma, standard_normal
from epicycle.actors.core.primitives cimport Words

from epicycle.actors import Constant, Exponential, Gamma, Normal, Uniform


cdef enum:
    CONSTANT, EXPONENTIAL, GAMMA, NORMAL, UNIFORM


cdef class Drawing:
    """A law of numbers, with its parameters and the stream that it draws from."""

    __slots__ = ("first", "law", "second", "stream")

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


cdef Drawing drawing_of(distribution, stream):
    """What draws from a distribution; None if that is left to Python."""
    cdef Drawing made = Drawing()
    kind = type(distribution)
    if kind is Constant:
        made.law, made.first = CONSTANT, distribution.value
    elif kind is Exponential:
        made.law, made.first = EXPONENTIAL, distribution.mean
    elif kind is Gamma:
        made.law, made.first, made.second = GAMMA, distribution.shape, distribution.mean / distribution.shape
    elif kind is Normal:
        made.law, made.first, made.second = NORMAL, distribution.mean, distribution.standard_deviation
    elif kind is Uniform:
        made.law, made.first, made.second = UNIFORM, distribution.low, distribution.high
    else:
        return None
    made.stream = stream
    return made


# -- forms -------------------------------------------------------------------------------------------------------------


cdef class Native(Form):
    """What the forms share: where an actor stands in the run, and who takes what it sends."""

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
