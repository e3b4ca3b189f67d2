"""Where tokens begin: Clock, PoissonClock and SingleEvent of their own accord, and what answers a trigger: Const, Ramp,
Sequence, Random, CurrentTime, CurrentMicrostep."""

from __future__ import annotations

from typing import Any, ClassVar

from .core import (
    Actor,
    InputPort,
    OutputPort,
    Parameter,
    ParameterError,
    PortParameter,
    Wake,
    array_parameter,
    to_nanoseconds,
    token_type,
)
from .distributions import Distribution


class _Ticking(Actor):
    """What clocks share: a counted series of tokens up to a stop time."""

    output = OutputPort(doc="the values in turn; without values the number of the tick, from 0")

    values: Parameter[Any] = Parameter(object, None, shape=(None,), doc="what the ticks send, over and over")
    stop_time: Parameter[float | None] = Parameter(
        float, None, unit="s", min=0, doc="the time after which there are no more ticks"
    )

    def check(self) -> None:
        if self.values is not None and not self.values:
            raise ParameterError("values: the list is empty, there is nothing to send")
        self.output.type = int if self.values is None else token_type(self.values)

    @property
    def is_endless(self) -> bool:
        return self.stop_time is None and not any(port.name == "stop" and port.width for port in self.inputs.values())

    def _send(self, tick: int) -> None:
        self.output.send(tick if self.values is None else self.values[tick % len(self.values)])

    def _wake_at(self, time: int) -> Wake | None:
        """The wake-up for the next tick at ``time`` ns, if there still is one."""
        if self.stop_time is not None and time > to_nanoseconds(self.stop_time):
            return None
        return self.context.wake(self, time)


class Clock(_Ticking):
    """Ticks at fixed times without drift: in cycle k at ``offset + k * period`` plus each of ``offsets``.

    Times are counted in whole nanoseconds from the start of the run, or from the latest ``start`` token if that port
    is connected.  Two equal offsets tick in successive microsteps.  A new period counts from the next cycle on.
    Ptolemy: ``DiscreteClock``, ``Clock``.
    """

    is_source: ClassVar[bool] = True

    start = InputPort(required=False, doc="begins a first cycle; if connected, nothing else does")
    stop = InputPort(required=False, doc="ends the ticking until the next start")

    period = PortParameter(float, unit="s", above=0, doc="length of a cycle, rounded to whole nanoseconds")
    offset = Parameter(float, 0.0, unit="s", min=0, doc="time from the start to the first cycle")
    offsets = array_parameter((None,), [0.0], unit="s", min=0, doc="when each cycle ticks, in order")

    def check(self) -> None:
        super().check()
        if not self.offsets.size or any(self.offsets[1:] < self.offsets[:-1]):
            raise ParameterError(f"offsets: {self.offsets.tolist()} is not an ascending list of times")
        self._check_period(self.period)

    def _check_period(self, period: float) -> None:
        if self.offsets[-1] >= period:
            raise ParameterError(f"offsets: {self.offsets[-1]:g} s is not within the period of {period:g} s")

    def initialize(self) -> None:
        self._offsets = [to_nanoseconds(offset) for offset in self.offsets]
        self._wake: Wake | None = None
        if not self.start.width:
            self._begin()
            self._wake = self._wake_at(self._next)

    def _begin(self) -> None:
        """Lay the first cycle from now on."""
        self._cycle = self.tag.time + to_nanoseconds(self.offset)
        self._tick = 0

    @property
    def _next(self) -> int:
        """The time of the next tick."""
        return self._cycle + self._offsets[self._tick % len(self._offsets)]

    def fire(self) -> None:
        due = self._wake is not None and self._wake.due
        if self.start.present or self.stop.present:
            if self._wake is not None:
                self._wake.cancel()
            self._wake = None
            due = False
        if self.start.present and not self.stop.present:
            self._begin()
            due = self._next == self.tag.time
            if not due:
                self._wake = self._wake_at(self._next)
        if due:
            self._send(self._tick)
            self._tick += 1
            if self._tick % len(self._offsets) == 0:
                self._check_period(self.period)
                # Counted in integers, so that no rounding adds up over a long run.
                self._cycle += to_nanoseconds(self.period)
            self._wake = self._wake_at(self._next)


class PoissonClock(_Ticking):
    """Ticks at random: the times between ticks are independent and exponentially distributed.

    Ptolemy: ``PoissonClock``.
    """

    mean_interval = Parameter(float, 1.0, unit="s", above=0, doc="mean time between two ticks")
    fire_at_start = Parameter(bool, True, doc="whether the first tick comes at the start")

    def initialize(self) -> None:
        self._tick = 0
        self._wake_at(self.tag.time + (0 if self.fire_at_start else self._interval()))

    def _interval(self) -> int:
        return to_nanoseconds(self.random.exponential(self.mean_interval))

    def fire(self) -> None:
        self._send(self._tick)
        self._tick += 1
        self._wake_at(self.tag.time + self._interval())


class SingleEvent(Actor):
    """Sends one token at one time.

    Ptolemy: ``SingleEvent``.
    """

    output = OutputPort(doc="the value")

    time = Parameter(float, 0.0, unit="s", min=0, doc="when it is sent")
    value: Parameter[Any] = Parameter(object, True, doc="what is sent")

    def check(self) -> None:
        self.output.type = token_type([self.value])

    def initialize(self) -> None:
        self.wake_at(self.time)

    def restart(self) -> None:
        if to_nanoseconds(self.time) >= self.tag.time:
            self.initialize()

    def fire(self) -> None:
        self.output.send(self.value)


class Const(Actor):
    """Sends the same value for each trigger; once at the start if ``trigger`` is not connected.

    The distribution that gives the same value always is ``Constant``.  Ptolemy: ``Const``.
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


class Random(Actor):
    """Sends a token drawn from ``distribution`` for each trigger, independent of all others.

    Ptolemy: ``Gaussian``, ``Uniform``, ``ColtExponential``, ``Bernoulli``, ``DiscreteRandomSource`` and others.
    """

    trigger = InputPort(doc="when to send")
    output = OutputPort(doc="the token drawn")

    distribution: Parameter[Distribution] = Parameter(Distribution, doc="what is drawn from")

    def check(self) -> None:
        self.output.type = self.distribution.token_type

    def fire(self) -> None:
        for _ in self.trigger.tokens:
            self.output.send(self.distribution.draw(self.random))


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
