"""Actors that stand in for Ptolemy's own test actors."""

from __future__ import annotations

from typing import Any, ClassVar

from epicycle.actors import Actor, CurrentMicrostep, CurrentTime, InputPort, OutputPort, Parameter, Tag


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


class TestActorPortDepth(Actor):
    """Sends the depths of all actors and their ports, which the test tells it."""

    __test__: ClassVar[bool] = False  # it is not for pytest to collect
    trigger: InputPort[Any] = InputPort(Any)
    output: OutputPort[Any] = OutputPort(Any)
    depths: ClassVar[dict[str, int]] = {}

    def fire(self) -> None:
        self.output.send(type(self).depths)


class MicrostepDelay(Actor):
    """Delays each token by some seconds and keeps its microstep, as Ptolemy's ``TimeDelay`` does."""

    input: InputPort[Any] = InputPort(Any)
    output: OutputPort[Any] = OutputPort(Any, depends_on=())

    delay = Parameter(float, 1.0, unit="s", min=0)

    def initialize(self) -> None:
        self._held: list[tuple[Tag, Any]] = []

    def fire(self) -> None:
        due = [token for tag, token in self._held if tag <= self.tag]
        self._held = [(tag, token) for tag, token in self._held if tag > self.tag]
        for token in due:
            self.output.send(token)
        for token in self.input.tokens:
            wake = self.wake_in(self.delay)
            self._held.append((Tag(wake.tag.time, self.tag.microstep), token))
        if any(tag.time == self.tag.time for tag, _ in self._held):
            self.wake_in(0)


class TimeOfSeveral(CurrentTime):
    """A CurrentTime to which two senders are connected: there these share one channel."""

    trigger: InputPort[Any] = InputPort(Any, multi=True)


class MicrostepOfSeveral(CurrentMicrostep):
    """The same of CurrentMicrostep."""

    trigger: InputPort[Any] = InputPort(Any, multi=True)


TYPES = (
    CancelFireAtTest,
    MicrostepDelay,
    MicrostepOfSeveral,
    Sink,
    TestActorPortDepth,
    TimeOfSeveral,
)
