"""Sources that answer a trigger: Const, Ramp, Sequence, CurrentTime, CurrentMicrostep."""

from __future__ import annotations

from typing import Any, ClassVar

from .core import Actor, InputPort, OutputPort, Parameter, PortParameter, token_type


class Const(Actor):
    """Sends the same value for each trigger; once at the start if ``trigger`` is not connected.

    Ptolemy: ``Const``.
    """

    is_source: ClassVar[bool] = True

    trigger = InputPort(required=False, doc="when to send; once at the start if not connected")
    output = OutputPort(doc="the value")

    value: Parameter[Any] = Parameter(object, 1, doc="what is sent")

    def check(self) -> None:
        self.output.type = token_type([self.value])

    def initialize(self) -> None:
        if not self.trigger.width:
            self.wake_in(0)

    def fire(self) -> None:
        for _ in self.trigger.tokens if self.trigger.width else (None,):
            self.output.send(self.value)


class Ramp(Actor):
    """Counts triggers: sends ``init`` for the first, and for each further one the last number plus ``step``.

    The numbers are integers if ``init`` and ``step`` are.  Ptolemy: ``Ramp``.
    """

    trigger = InputPort(doc="when to send")
    output = OutputPort(float, doc="the number")

    init: Parameter[float] = Parameter(int | float, 0, doc="the first number")
    step: PortParameter[float] = PortParameter(int | float, 1, doc="what is added from one to the next")

    def initialize(self) -> None:
        self._last: float | None = None

    def fire(self) -> None:
        for _ in self.trigger.tokens:
            self._last = self.init if self._last is None else self._last + self.step
            self.output.send(self._last)


class Sequence(Actor):
    """Sends the next of its values for each trigger, and nothing when they are used up.

    If ``enable`` is connected, a value is sent only at a tag at which it is true; without ``trigger``, each true
    token of ``enable`` is a trigger.  Ptolemy: ``Sequence``.
    """

    trigger = InputPort(required=False, doc="when to send")
    enable = InputPort(bool, required=False, doc="whether to send")
    output = OutputPort(doc="the values in turn")

    values: Parameter[Any] = Parameter(object, shape=(None,), doc="what is sent")
    repeat = Parameter(bool, False, doc="whether to begin again after the last value")

    def check(self) -> None:
        self.output.type = token_type(self.values)

    def initialize(self) -> None:
        self._next = 0

    def fire(self) -> None:
        for _ in range(self._triggers()):
            if self.repeat and self.values:
                self._next %= len(self.values)
            if self._next < len(self.values):
                self.output.send(self.values[self._next])
                self._next += 1

    def _triggers(self) -> int:
        if not self.enable.width:
            return len(self.trigger.tokens)
        if not self.trigger.width:
            return sum(map(bool, self.enable.tokens))
        return len(self.trigger.tokens) if self.enable.present and self.enable.value else 0


class CurrentTime(Actor):
    """Sends the present time for each trigger.

    Ptolemy: ``CurrentTime``.
    """

    trigger = InputPort(doc="when to send")
    output = OutputPort(float, doc="the time in s")

    def fire(self) -> None:
        for _ in self.trigger.tokens:
            self.output.send(self.now)


class CurrentMicrostep(Actor):
    """Sends the present microstep for each trigger.

    Ptolemy: ``CurrentMicrostep``.
    """

    trigger = InputPort(doc="when to send")
    output = OutputPort(int, doc="the microstep, from 1")

    def fire(self) -> None:
        for _ in self.trigger.tokens:
            self.output.send(self.tag.microstep)
