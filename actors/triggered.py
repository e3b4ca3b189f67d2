"""Actors that answer triggers: Const, Ramp, Sequence, Pulse, CurrentTime, CurrentMicrostep.

Triggers that come together, one at each connection, count as one, except for CurrentTime.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from .core import (
    Actor,
    EpicycleError,
    InputPort,
    OutputPort,
    Parameter,
    ParameterError,
    PortParameter,
    any_parameter,
    counted,
    rounds,
    token_type,
)


def times(trigger: InputPort[Any]) -> int:
    """The number of answers at this tag."""
    return len(trigger.tokens) if trigger.width <= 1 else len(list(rounds(trigger)))


class _Answering(Actor):
    """The common part of sources that answer triggers, with a limit."""

    trigger = InputPort(multi=True, doc="when to send")

    limit = Parameter(int, None, min=1, doc="number of answers; unlimited if left out")

    def initialize(self) -> None:
        self._answers = 0

    def answers(self) -> int:
        """The number of answers at this tag."""
        wanted = times(self.trigger) if self.trigger.width or self.trigger.required else 1
        if self.limit is not None:
            wanted = min(wanted, self.limit - self._answers)
        self._answers += wanted
        return wanted


class Const(_Answering):
    """Sends the same value for each trigger; once at the start if ``trigger`` is not connected.

    The distribution that always gives the same value is ``Constant``.  Ptolemy: ``Const``.
    """

    is_source: ClassVar[bool] = True

    trigger = InputPort(multi=True, required=False, doc="when to send; once at the start if not connected")
    output = OutputPort(doc="the value")

    value = any_parameter(1, doc="the value to send")

    def check(self) -> None:
        self.output.type = token_type([self.value])

    def initialize(self) -> None:
        super().initialize()
        if not self.trigger.width:
            self.wake_in(0)

    def fire(self) -> None:
        for _ in range(self.answers()):
            self.output.send(self.value)


class Ramp(_Answering):
    """Counts triggers: sends ``init`` for the first one, and ``step`` more for each further one.

    The numbers are integers if ``init`` and ``step`` are; tokens at these ports must then be integers, too.
    Ptolemy: ``Ramp``.
    """

    output = OutputPort(float, doc="the number")

    init = PortParameter(int | float, 0, doc="the first number; a token sets the next one")
    step = PortParameter(int | float, 1, doc="difference between successive numbers")

    def check(self) -> None:
        self.output.type = int if isinstance(self.init, int) and isinstance(self.step, int) else float

    def initialize(self) -> None:
        super().initialize()
        self._last: float | None = None  # before the first number, and when a token has set the next one

    def fire(self) -> None:
        if self.inputs["init"].present:
            self._last = None
        for _ in range(self.answers()):
            self._last = self.following()
            if self.output.type is int and not isinstance(self._last, int):
                raise EpicycleError(
                    f"init and step are whole numbers, but a step of {self.step!r} came; write 'init: "
                    f"{self.init:.1f}' to allow fractions"
                )
            self.output.send(self._last)

    def following(self) -> float:
        """The next number."""
        return self.init if self._last is None else self._last + self.step


class Sequence(Actor):
    """Sends the next of its values for each trigger, and nothing when all are used.

    If ``enable`` is connected, a value is sent only at a tag at which it is true; without ``trigger``, each true
    token of ``enable`` is a trigger.  Ptolemy: ``Sequence``.
    """

    trigger = InputPort(multi=True, required=False, doc="when to send")
    enable = InputPort(bool, required=False, doc="whether to send")
    output = OutputPort(doc="the values, in order")

    values = any_parameter(shape=(None,), doc="the values to send, in order")
    repeat = Parameter(bool, False, doc="whether to start again after the last value")
    hold = Parameter(bool, False, doc="whether to repeat the last value when all are used")

    def check(self) -> None:
        if self.repeat and self.hold:
            raise ParameterError(
                "repeat and hold cannot both be true: after the last value comes either the first or the last one again"
            )
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
                if self.hold:
                    self._next = min(self._next, len(self.values) - 1)

    def _triggers(self) -> int:
        if not self.enable.width:
            return times(self.trigger)
        if not self.trigger.width:
            return sum(map(bool, self.enable.tokens))
        return times(self.trigger) if self.enable.present and self.enable.value else 0


class Pulse(_Answering):
    """Sends a value at certain triggers, counted from 0, and a zero of the same kind at all others.

    A zero is 0, 0.0, false, an empty text, or a list or record of zeros.  Ptolemy: ``Pulse``.
    """

    output = OutputPort(doc="a value, or zero")

    values = any_parameter([1, 0], shape=(None,), doc="the values to send, in order")
    indexes = any_parameter([0, 1], shape=(None,), doc="numbers of the triggers for the values, ascending")
    repeat = Parameter(bool, False, doc="whether to count from 0 again after the last value")

    def check(self) -> None:
        count = [each for each in self.indexes if isinstance(each, int) and not isinstance(each, bool) and each >= 0]
        if len(count) != len(self.indexes) or count != sorted(set(count)):
            raise ParameterError(f"indexes: {list(self.indexes)} is not an ascending list of whole numbers >= 0")
        if not self.values:
            raise ParameterError("values: the list is empty; give at least one value")
        if len(self.values) != len(self.indexes):
            raise ParameterError(
                f"values: {counted(len(self.values), 'value')} for {len(self.indexes)} of 'indexes'; give one for each"
            )
        self.output.type = token_type(self.values)

    def initialize(self) -> None:
        super().initialize()
        self._count = 0  # of triggers
        self._place = 0  # of the next value

    def fire(self) -> None:
        for _ in range(self.answers()):
            if self._place == len(self.values) and self.repeat:
                self._count = self._place = 0
                if self.indexes[0] > 0:  # as in Ptolemy: the trigger that starts again is answered only by a value
                    self._count = 1
                    continue
            if self._place < len(self.values) and self._count == self.indexes[self._place]:
                self.output.send(self.values[self._place])
                self._place += 1
            else:
                self.output.send(_zero(self.values[0]))
            self._count += 1


def _zero(value: Any) -> Any:
    """The zero of the kind of a value."""
    if isinstance(value, Mapping):
        return {name: _zero(each) for name, each in value.items()}
    return [_zero(each) for each in value] if isinstance(value, (list, tuple)) else type(value)()


class CurrentTime(Actor):
    """Sends the present time for each trigger, also for each of several that come together.

    Ptolemy: ``CurrentTime``.
    """

    trigger = InputPort(multi=True, doc="when to send")
    output = OutputPort(float, doc="the time in s")

    def fire(self) -> None:
        for _ in self.trigger.tokens:
            self.output.send(self.now)


class CurrentMicrostep(Actor):
    """Sends the present microstep for each trigger.

    Ptolemy: ``CurrentMicrostep``.
    """

    trigger = InputPort(multi=True, doc="when to send")
    output = OutputPort(int, doc="the microstep, from 1")

    def fire(self) -> None:
        for _ in range(times(self.trigger)):
            self.output.send(self.tag.microstep)
