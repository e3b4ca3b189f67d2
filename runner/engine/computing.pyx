# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True
"""Native forms of what computes with floats; see forms.pyx.  Anything else than floats is left to the actor."""

from cpython.float cimport PyFloat_FromDouble

from epicycle.actors cimport InputPort, seconds_of
from epicycle.runner.engine.native cimport Native, all_floats, count_of, tokens_of
from epicycle.runner.engine.way cimport Sender

from epicycle.actors import AddSubtract, Counter, Expression, Integrator, Scale
from epicycle.actors.expression.floats import UNDECIDED


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
        cdef list tokens = tokens_of(self.input)
        cdef Py_ssize_t place
        if not all_floats(tokens):
            self.actor.fire()
            return
        for place in range(len(tokens)):
            self.output.go(PyFloat_FromDouble(self.number * <double>tokens[place] + self.offset_number))


cdef class ExpressionForm(Native):
    __slots__ = ("actor", "director", "function", "holds", "inputs", "latest", "names", "output", "ports", "turn", "wants_number")
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
        return self.output is not None and self.function is not None and is_whole

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
            value = None
        if value is None:
            value = self.actor._value(dict(self.latest))
        elif type(value) is not float or not self.wants_number:
            value = self.actor._checked(value)
        self.output.go(value)


cdef class SumForm(Native):
    __slots__ = ("actor", "director", "minus", "output", "plus", "turn")
    cdef public InputPort plus, minus
    cdef public Sender output

    cdef bint take(self) except -1:
        self.plus, self.minus, self.output = self.input_port("plus"), self.input_port("minus"), self.sender("output")
        return self.output is not None

    cpdef fire(self):
        if not (is_round(self.plus) and is_round(self.minus)):
            self.actor.fire()
        elif count_of(self.plus) + count_of(self.minus):
            self.output.go(PyFloat_FromDouble(sum_of(self.plus) - sum_of(self.minus)))


cdef bint is_round(InputPort port) except -1:
    """Whether there is a float at most from each channel, in their order; of two, the order does not count."""
    cdef Py_ssize_t place, count = count_of(port)
    if not all_floats(tokens_of(port)):
        return False
    if count < 2 or port.width < 2:
        return count < 2
    for place in range(1, count):
        if not (port.channels[place - 1] < port.channels[place] or count == 2 and port.channels[0] != port.channels[1]):
            return False
    return True


cdef double sum_of(InputPort port):
    cdef double total = 0.0
    for token in tokens_of(port):
        total += <double>token
    return total


cdef class CounterForm(Native):
    __slots__ = ("actor", "decrement", "director", "increment", "output", "reset", "turn")
    cdef public InputPort increment, decrement, reset
    cdef public Sender output

    cdef bint take(self) except -1:
        if self.actor.reset_by != "any" or self.actor.reset_last:
            return False
        self.increment, self.decrement = self.input_port("increment"), self.input_port("decrement")
        self.reset, self.output = self.input_port("reset"), self.sender("output")
        return self.output is not None

    cpdef fire(self):
        number = self.actor.initial if count_of(self.reset) else self.actor._number
        number += count_of(self.increment) - count_of(self.decrement)
        self.actor._number = number
        self.output.go(number)


cdef class IntegratorForm(Native):
    __slots__ = ("actor", "director", "holds", "input", "output", "trigger", "turn")
    cdef public InputPort input, trigger
    cdef public Sender output
    cdef public bint holds

    cdef bint take(self) except -1:
        self.input, self.trigger, self.output = self.input_port("input"), self.input_port("trigger"), self.sender("output")
        self.holds = self.actor.method == "hold"
        return self.output is not None and not self.actor.reset.width

    cpdef fire(self):
        cdef list tokens = tokens_of(self.input)
        cdef double integral, value = 0.0, token, elapsed = 0.0
        before, sum_before = self.actor._value, self.actor._integral
        if not (all_floats(tokens) and type(sum_before) is float and (before is None or type(before) is float)):
            self.actor.fire()
            return
        integral = sum_before
        if before is not None:
            value, elapsed = before, seconds_of(self.now() - <long long>self.actor._since)
        if not tokens:
            if count_of(self.trigger):
                self.output.go(PyFloat_FromDouble(integral + elapsed * value))
            return
        for each in tokens:
            token = each
            if before is None:
                integral += elapsed * (0.0 if self.holds else token)
            else:
                integral += elapsed * (value if self.holds else (value + token) / 2)
            before, value, elapsed = each, token, 0.0
            self.actor._integral, self.actor._value, self.actor._since = integral, each, self.now()
            self.output.go(PyFloat_FromDouble(integral))


FORMS = {
    AddSubtract: SumForm,
    Counter: CounterForm,
    Expression: ExpressionForm,
    Integrator: IntegratorForm,
    Scale: ScaleForm,
}
