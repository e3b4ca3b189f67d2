"""Actors that stand in for Ptolemy's own test actors, and for library actors where a name is enough."""

from __future__ import annotations

from typing import Any, ClassVar

from epicycle.actors import Actor, InputPort, OutputPort, Parameter


class Scale(Actor):
    """Multiplies every token."""

    input = InputPort(float)
    output = OutputPort(float)
    factor: Parameter[float] = Parameter(int | float, 1)

    def fire(self) -> None:
        for token in self.input.tokens:
            self.output.send(self.factor * token)


class AddSubtract(Actor):
    """Sends the sum of what comes at ``plus`` less what comes at ``minus``."""

    plus = InputPort(float, multi=True, required=False)
    minus = InputPort(float, multi=True, required=False)
    output = OutputPort(float)

    def fire(self) -> None:
        self.output.send(sum(self.plus.tokens) - sum(self.minus.tokens))


class Comparator(Actor):
    """Sends whether left >= right."""

    left = InputPort(float)
    right = InputPort(float)
    output = OutputPort(bool)
    comparison = Parameter(str, ">=", choices=(">=",))

    def fire(self) -> None:
        self.output.send(self.left.value >= self.right.value)


class GreaterThan(Actor):
    """Sends whether a token is above a bound."""

    input = InputPort(float)
    output = OutputPort(bool)
    bound = Parameter(float)

    def fire(self) -> None:
        self.output.send(self.input.value > self.bound)


class Sink(Actor):
    """Takes anything; the output, on which nothing is sent, is there for its depth."""

    input: InputPort[Any] = InputPort(Any, multi=True)
    output: OutputPort[Any] = OutputPort(Any)

    def fire(self) -> None:
        pass


class CancelFireAtTest(Actor):
    """Asks to fire at every second from 0 to 4 and takes back what it asked for at 1 and 3.

    In Ptolemy's actor of this name, each firing asks for two more and cancels the first of them.
    """

    is_source: ClassVar[bool] = True
    out = OutputPort(bool)

    def initialize(self) -> None:
        self.wake_in(0)

    def fire(self) -> None:
        self.out.send(True)
        if self.now < 4:
            first = self.wake_in(1)
            self.wake_in(2)
            first.cancel()


class PortDepths(Actor):
    """Sends the depths of all actors and their ports; the test fills them in."""

    trigger: InputPort[Any] = InputPort(Any)
    output: OutputPort[Any] = OutputPort(Any)
    depths: ClassVar[dict[str, dict[str, int]]] = {}

    def fire(self) -> None:
        self.output.send(type(self).depths)


TYPES = (Scale, AddSubtract, Comparator, GreaterThan, Sink, CancelFireAtTest, PortDepths)
