# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
"""What native forms are made of: times, draws, and where an actor stands in the run."""

from libc.math cimport frexp, rint, sqrt

from epicycle.actors import Constant, Exponential, Gamma, Normal, Uniform
from epicycle.actors import to_nanoseconds as exactly_to_nanoseconds
from epicycle.actors import to_seconds as exactly_to_seconds
from epicycle.actors.core.elementary import log as far_log
from epicycle.actors.core.elementary import pow as power
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


# -- draws, operation by operation as ``laws`` and ``elementary`` have them ---------------------------------------------


cdef double logarithm(double x) except? -1.0:
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


cdef uint64_t word(stream) except? 0:
    cdef Words words = stream
    return words._ahead.pop() if words._ahead else words.word()


cdef double between(stream) except? -1.0:
    return (<double>(word(stream) >> 12) + 0.5) * (1.0 / 4503599627370496.0)


cdef double normal_quantile(double share) except? -1.0:
    cdef double q = share - 0.5, r, above, below
    if -0.425 <= q <= 0.425:
        r = 0.180625 - q * q
        above = (((((((2509.0809287301226727 * r + 33430.575583588128105) * r + 67265.770927008700853) * r
            + 45921.953931549871457) * r + 13731.693765509461125) * r + 1971.5909503065514427) * r
            + 133.14166789178437745) * r + 3.3871328727963666080)
        below = (((((((5226.4952788528545610 * r + 28729.085735721942674) * r + 39307.895800092710610) * r
            + 21213.794301586595867) * r + 5394.1960214247511077) * r + 687.18700749205790830) * r
            + 42.313330701600911252) * r + 1.0)
        return q * above / below
    r = sqrt(-logarithm(share if q < 0.0 else 1.0 - share))
    if r <= 5.0:
        r -= 1.6
        above = (((((((7.74545014278341407640e-4 * r + 0.0227238449892691845833) * r + 0.241780725177450611770) * r
            + 1.27045825245236838258) * r + 3.64784832476320460504) * r + 5.76949722146069140550) * r
            + 4.63033784615654529590) * r + 1.42343711074968357734)
        below = (((((((1.05075007164441684324e-9 * r + 5.47593808499534494600e-4) * r + 0.0151986665636164571966) * r
            + 0.148103976427480074590) * r + 0.689767334985100004550) * r + 1.67638483018380384940) * r
            + 2.05319162663775882187) * r + 1.0)
    else:
        r -= 5.0
        above = (((((((2.01033439929228813265e-7 * r + 2.71155556874348757815e-5) * r + 0.00124266094738807843860) * r
            + 0.0265321895265761230930) * r + 0.296560571828504891230) * r + 1.78482653991729133580) * r
            + 5.46378491116411436990) * r + 6.65790464350110377720)
        below = (((((((2.04426310338993978564e-15 * r + 1.42151175831644588870e-7) * r + 1.84631831751005468180e-5) * r
            + 7.86869131145613259100e-4) * r + 0.0148753612908506148525) * r + 0.136929880922735805310) * r
            + 0.599832206555887937690) * r + 1.0)
    return above / below if q > 0.0 else -above / below


cdef double standard_gamma(stream, double shape) except? -1.0:
    cdef double d, c, x, v, square, share
    if shape < 1.0:
        return standard_gamma(stream, shape + 1.0) * <double>power(between(stream), 1.0 / shape) if shape else 0.0
    d = shape - 1.0 / 3.0
    c = 1.0 / sqrt(9.0 * d)
    while True:
        x = normal_quantile(between(stream))
        v = 1.0 + c * x
        if v <= 0.0:
            continue
        v = v * v * v
        square = x * x
        share = between(stream)
        if share < 1.0 - 0.0331 * square * square or logarithm(share) < 0.5 * square + d * (1.0 - v + logarithm(v)):
            return d * v


cdef enum:
    CONSTANT, EXPONENTIAL, GAMMA, NORMAL, UNIFORM


cdef class Drawing:
    """A law of numbers, with its parameters and the stream that it draws from."""

    __slots__ = ("first", "law", "second", "stream")

    cdef double next(self) except? -1.0:
        if self.law == EXPONENTIAL:
            return self.first * -logarithm(1.0 - between(self.stream))
        if self.law == GAMMA:
            return self.second * standard_gamma(self.stream, self.first)
        if self.law == NORMAL:
            return self.first + self.second * normal_quantile(between(self.stream))
        if self.law == UNIFORM:
            return self.first + (self.second - self.first) * (<double>(word(self.stream) >> 11) * (0.5 / 4503599627370496.0))
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
