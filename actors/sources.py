"""Actors that start things of their own accord."""

from __future__ import annotations

from typing import ClassVar

from .core import Actor, OutputPort, Parameter, to_nanoseconds


class Clock(Actor):
    """Ticks for ever, without drift: tick k comes ``offset + k * period`` after the start."""

    is_source: ClassVar[bool] = True

    output = OutputPort(int, doc="the number of the tick, from 0")

    period = Parameter(float, unit="s", min=1e-9, doc="time between two ticks, rounded to whole nanoseconds")
    offset = Parameter(float, 0.0, unit="s", min=0, doc="time from the start to the first tick")

    def initialize(self) -> None:
        # Counted in integers, so that no rounding adds up over a long run.
        self._period = to_nanoseconds(self.period)
        self._first = self.tag.time + to_nanoseconds(self.offset)
        self._ticks = 0
        self.context.wake(self, self._first)

    def fire(self) -> None:
        self.output.send(self._ticks)
        self._ticks += 1
        self.context.wake(self, self._first + self._ticks * self._period)
