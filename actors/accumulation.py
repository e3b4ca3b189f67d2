"""Actors that add up tokens, or compute how they change: Counter, Accumulator, Integrator, TimeAverage, Derivative,
Difference."""

from __future__ import annotations

from typing import Any

from .core import (
    Actor,
    EpicycleError,
    InputPort,
    OutputPort,
    Parameter,
    ParameterError,
    elementary,
    present,
    rounds,
    to_seconds,
)


class Counter(Actor):
    """Counts tokens of any kind: up for each at ``increment``, down for each at ``decrement``.

    The count is sent once for each tag at which tokens came.  Ptolemy: ``Counter``.
    """

    increment = InputPort(multi=True, required=False, doc="each token increases the count by 1")
    decrement = InputPort(multi=True, required=False, doc="each token decreases the count by 1")
    reset = InputPort(required=False, doc="resets the count, before the tokens of the tag are counted")
    output = OutputPort(int, doc="the number")

    initial = Parameter(int, 0, doc="the count at the start and after a reset")
    reset_by = Parameter(str, "any", choices=("any", "true"), doc="which tokens reset: any, or only true ones")

    def initialize(self) -> None:
        self._number = self.initial

    def fire(self) -> None:
        is_reset = any(token is True or self.reset_by == "any" for token in self.reset.tokens)
        if is_reset:
            self._number = self.initial
        up, down = len(self.increment.tokens), len(self.decrement.tokens)
        self._number += up - down
        if is_reset or up or down:
            self.output.send(self._number)


class Accumulator(Actor):
    """The sum of all tokens so far, including those of the present tag.

    Ptolemy: ``Accumulator``.
    """

    input = InputPort(float, multi=True, doc="the numbers to add")
    reset = InputPort(multi=True, required=False, doc="resets the sum, before the tokens of the tag are added")
    output = OutputPort(float, doc="the sum, sent for each round of tokens and at a reset")

    initial = Parameter(int | float, 0, doc="the sum at the start and after a reset")
    reset_by = Parameter(str, "any", choices=("any", "true"), doc="which tokens reset: any, or only true ones")
    low = Parameter(int | float, None, doc="the lowest value of the sum")
    high = Parameter(int | float, None, doc="the highest value of the sum")

    def check(self) -> None:
        if self.low is not None and self.high is not None and self.low > self.high:
            raise ParameterError(f"low is {self.low:g} and high is {self.high:g}: low must not be above high")

    def initialize(self) -> None:
        self._sum = self.initial

    def fire(self) -> None:
        if self.reset.present:
            if self.reset_by == "any" or any(token is True for token in self.reset.tokens):
                self._sum = self.initial
            if not self.input.present:
                self._send()
        for (tokens,) in rounds(self.input):
            self.add(present(tokens))
            self._send()

    def add(self, tokens: list[Any]) -> None:
        """Add the tokens of a round to the sum."""
        self._sum += elementary.total(tokens)

    def _send(self) -> None:
        if self.low is not None and self._sum < self.low:
            self._sum = self.low
        if self.high is not None and self._sum > self.high:
            self._sum = self.high
        self.output.send(self._sum)


class Integrator(Actor):
    """The integral over time of a signal that arrives as tokens.

    ``hold``: the signal keeps the value of a token until the next one comes, ``sum(x[k] * (t[k+1] - t[k]))``, which is
    exact for queue lengths and other step signals.  ``trapezoid``: it is linear from token to token, ``sum((x[k] +
    x[k+1]) / 2 * (t[k+1] - t[k]))``.  Before the first token the signal is 0.  The integral up to now is sent for each
    token and for each ``trigger``; up to a trigger, the signal holds its latest value.
    The unit is that of the input times s.  Ptolemy: ``Integrator`` of its DE library (``trapezoid``); for its
    continuous ``Integrator``, see ``ODE``.
    """

    input = InputPort(float, doc="the signal")
    trigger = InputPort(required=False, doc="requests the integral at other times")
    reset = InputPort(
        required=False, doc="restarts the integral after this tag, when the integral up to now has been sent"
    )
    output = OutputPort(float, doc="the integral up to now")

    method = Parameter(str, "hold", choices=("hold", "trapezoid"), doc="what the signal does between two tokens")
    initial = Parameter(float, 0.0, doc="the integral at the start")

    def initialize(self) -> None:
        self._integral = self.initial
        self._value: float | None = None
        self._since = 0

    def fire(self) -> None:
        for token in self.input.tokens:
            middle = token if self._value is None else (self._value + token) / 2
            self._integral += self._elapsed() * (self._held if self.method == "hold" else middle)
            self._value, self._since = token, self.tag.time
            self.output.send(self._integral)
        if self.trigger.present and not self.input.present:
            self.output.send(self._integral + self._elapsed() * self._held)
        if self.reset.present:
            if not (self.input.present or self.trigger.present):
                self.output.send(self._integral)
            self.initialize()

    @property
    def _held(self) -> float:
        return 0.0 if self._value is None else self._value

    def _elapsed(self) -> float:
        """Seconds since the latest token; 0 before the first, because the signal is 0 until then."""
        return 0.0 if self._value is None else to_seconds(self.tag.time - self._since)


class Derivative(Actor):
    """The rate of change of a signal from token to token: ``(x[k] - x[k-1]) / (t[k] - t[k-1])``; nothing for the first.

    Two tokens at the same time must be equal; nothing is sent for the second.  The unit is that of the input per s.
    Ptolemy: ``Derivative``.
    """

    input = InputPort(float, doc="the signal")
    reset = InputPort(required=False, doc="forgets the signal after this tag")
    output = OutputPort(float, doc="its slope")

    def initialize(self) -> None:
        self._value: float | None = None
        self._since = 0

    def fire(self) -> None:
        for token in self.input.tokens:
            gap = self.tag.time - self._since
            if self._value is not None and gap:
                self.output.send((token - self._value) / to_seconds(gap))
            elif self._value not in (None, token):
                raise EpicycleError(f"{self._value!r} and {token!r} came at the same time, and a jump has no slope")
            self._value, self._since = token, self.tag.time
        if self.reset.present:
            self.initialize()


class TimeAverage(Actor):
    """The mean over time of a signal that keeps the value of a token until the next one comes, from 0 s up to now.

    Before the first token the signal is 0.  The mean is sent for each token from the second on, but not at 0 s.
    Ptolemy: ``AverageOverTime``.
    """

    input = InputPort(float, doc="the signal")
    output = OutputPort(float, doc="its mean")

    def initialize(self) -> None:
        self._integral = 0.0
        self._value: float | None = None
        self._since = 0

    def fire(self) -> None:
        now = self.tag.time
        for token in self.input.tokens:
            if self._value is not None:
                self._integral += self._value * to_seconds(now - self._since)
                if now:
                    self.output.send(self._integral / to_seconds(now))
            self._value, self._since = token, now


class Difference(Actor):
    """Each token minus the one before it.

    Nothing is sent for the first token unless ``initial`` is given.  Ptolemy: ``Differential``.
    """

    input = InputPort(float, doc="the numbers")
    output = OutputPort(float, doc="x[k] - x[k-1]")

    initial = Parameter(int | float, None, doc="used as the token before the first")

    def initialize(self) -> None:
        self._before = self.initial

    def fire(self) -> None:
        for token in self.input.tokens:
            if self._before is not None:
                self.output.send(token - self._before)
            self._before = token
