"""Nonlinear elements in the path of a signal: Limiter, Quantizer, DeadZone and Hysteresis."""

from __future__ import annotations

import math

from ..core import Actor, EpicycleError, InputPort, OutputPort, Parameter, ParameterError, brief, to_seconds
from ..readings import finite_number


class Limiter(Actor):
    """Limits a signal and its rates of change: an actuator's saturation and slew.

    Each token gives the nearest value that is within the limits and that the output can reach, at the given rates, in
    the time since the value sent before.  While the output is still moving, a ``trigger`` sends its present value.
    Without ``initial``, the first token can always be reached.  Ptolemy: ``Limiter``.
    """

    input = InputPort(float, doc="the signal, held between tokens")
    trigger = InputPort(required=False, doc="requests the output at other times")
    output = OutputPort(float, doc="the limited signal")

    low = Parameter(float, -math.inf, doc="the lowest value")
    high = Parameter(float, math.inf, doc="the highest value")
    rising = Parameter(float, None, min=0, doc="fastest rise, per s; unlimited if left out")
    falling = Parameter(float, None, min=0, doc="fastest fall, per s, as a positive number; unlimited if left out")
    initial = Parameter(float, None, doc="the output before the first token")

    def check(self) -> None:
        if self.low > self.high:
            raise ParameterError(f"low is {self.low:g} and high is {self.high:g}: low must not be above high")
        if self.initial is not None and not self.low <= self.initial <= self.high:
            raise ParameterError(f"initial: {self.initial:g} is not within {self.low:g} and {self.high:g}")

    def initialize(self) -> None:
        self._wanted = self._reached = self.initial
        self._since = self.tag.time

    def fire(self) -> None:
        for token in self.input.tokens:
            self._wanted = min(max(finite_number(self.input, token), self.low), self.high)
            self._send()
        if self.trigger.present and not self.input.present and self._wanted is not None:
            self._send()

    def _send(self) -> None:
        value, elapsed = self._wanted, to_seconds(self.tag.time - self._since)
        assert value is not None
        if self._reached is not None and self.rising is not None:
            value = min(value, self._reached + self.rising * elapsed)
        if self._reached is not None and self.falling is not None:
            value = max(value, self._reached - self.falling * elapsed)
        self._reached, self._since = value, self.tag.time
        self.output.send(value)


class Quantizer(Actor):
    """Rounds a signal to steps, as an analog-to-digital converter does.

    Of two equally near steps, the even one is taken.  To disturb an existing signal, use the aspect ``Quantise``.
    Ptolemy: ``Quantizer``.
    """

    input = InputPort(float, doc="the signal")
    output = OutputPort(float, doc="the rounded signal")

    step = Parameter(float, above=0, doc="size of a step")
    offset = Parameter(float, 0.0, doc="the value of one of the steps")
    rounding = Parameter(
        str, "nearest", choices=("nearest", "down", "up"), doc="which of the neighbouring steps is taken"
    )

    def fire(self) -> None:
        for token in self.input.tokens:
            place = (finite_number(self.input, token) - self.offset) / self.step
            if not math.isfinite(place) or math.isinf(self.step):
                raise EpicycleError(
                    f"{brief(token)} is too large or not a number, and cannot be rounded to steps of {self.step:g}"
                )
            if self.rounding == "nearest":
                number = round(place)
            else:
                number = math.floor(place) if self.rounding == "down" else math.ceil(place)
            self.output.send(self.offset + number * self.step)


class DeadZone(Actor):
    """Outputs zero between two values, and the excess beyond them: play, or a valve with overlap.

    Source: J.-J. Slotine and W. Li, Applied Nonlinear Control, 1991, section 5.2.
    """

    input = InputPort(float, doc="the signal")
    output = OutputPort(float, doc="0 within the zone; outside it, the distance from the zone")

    low = Parameter(float, doc="lower end of the zone")
    high = Parameter(float, doc="upper end of the zone")

    def check(self) -> None:
        if self.low > self.high:
            raise ParameterError(f"low is {self.low:g} and high is {self.high:g}: low must not be above high")

    def fire(self) -> None:
        for token in self.input.tokens:
            value = finite_number(self.input, token)
            self.output.send(value - min(max(value, self.low), self.high))


class Hysteresis(Actor):
    """Switches on when a signal reaches one value, and off when it falls to another: a relay, a Schmitt trigger.

    A thermostat that heats when it is cold: ``{type: Hysteresis, upper: 21, lower: 19, on: 0, off: 1000}``.
    Source: J.-J. Slotine and W. Li, Applied Nonlinear Control, 1991, section 5.2.
    """

    input = InputPort(float, doc="the signal")
    output = OutputPort(float, doc="'on' or 'off', for each token")
    switched = OutputPort(bool, doc="whether it is on, sent when that changes")

    upper = Parameter(float, doc="at or above this it switches on")
    lower = Parameter(float, doc="at or below this it switches off")
    on = Parameter(float, 1.0, doc="what is sent while it is on")
    off = Parameter(float, 0.0, doc="what is sent while it is off")
    initial = Parameter(bool, False, doc="whether it is on at the start")

    def check(self) -> None:
        if self.lower >= self.upper:
            raise ParameterError(f"lower is {self.lower:g} and upper is {self.upper:g}: lower must be below upper")

    def initialize(self) -> None:
        self._is_on = self.initial

    def fire(self) -> None:
        for token in self.input.tokens:
            value, was_on = finite_number(self.input, token), self._is_on
            self._is_on = value > self.lower if was_on else value >= self.upper
            if self._is_on != was_on:
                self.switched.send(self._is_on)
            self.output.send(self.on if self._is_on else self.off)
