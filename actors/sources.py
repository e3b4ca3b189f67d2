"""Actors that start things of their own accord: Clock, PoissonClock, SingleEvent."""

from __future__ import annotations

from collections.abc import Sequence
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
        values: Sequence[Any] | None = self.values
        self.output.send(tick if values is None else values[tick % len(values)])

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

    period = PortParameter(float, unit="s", min=1e-9, doc="length of a cycle, rounded to whole nanoseconds")
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

    mean_interval = Parameter(float, 1.0, unit="s", min=1e-9, doc="mean time between two ticks")
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
