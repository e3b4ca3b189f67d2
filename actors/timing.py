"""Actors that deal with time: TimeDelay, Timer, ResettableTimer, WaitingTime, TimeCompare, TimeGap."""

from __future__ import annotations

import math
from collections import deque
from typing import Any

from .core import (
    Actor,
    EpicycleError,
    InputPort,
    OutputPort,
    Parameter,
    Pending,
    PortParameter,
    Tag,
    Wake,
    any_parameter,
    to_seconds,
    token_type,
)


class TimeDelay(Actor):
    """Sends each token after a delay; with delay 0 at the next microstep.

    A token is delayed by the value of ``delay`` at its tag, so one may overtake another.  The output does not depend on
    the inputs within the same tag, so the actor may be part of a loop.  A ``Server`` with ``servers: null`` draws the
    delay of each token from a ``distribution``.  Ptolemy: ``TimeDelay``, ``TimedDelay``, ``VariableDelay``.
    """

    input = InputPort(doc="tokens to delay")
    output = OutputPort(depends_on=(), doc="each token after its delay")

    delay = PortParameter(float, 1.0, unit="s", min=0, doc="how long each token is held")

    def initialize(self) -> None:
        self._held: Pending[Any] = Pending(self)

    def fire(self) -> None:
        for token in self._held.due():
            self.output.send(token)
        for token in self.input.tokens:
            self._held.put(token, self.delay)


class _Timing(Actor):
    """The common part of timers: they send a value when a time is over."""

    input = InputPort(float, doc="time until the value is sent, in s")
    output = OutputPort(depends_on=(), doc="the value, when the time is over")

    value = any_parameter(True, doc="the value to send")

    def check(self) -> None:
        self.output.type = token_type([self.value])


class Timer(_Timing):
    """Sends a value after the number of seconds in each token; any number of times may run in parallel.

    Ptolemy: ``Timer``.
    """

    def initialize(self) -> None:
        self._running: Pending[None] = Pending(self)

    def fire(self) -> None:
        for _ in self._running.due():
            self.output.send(self.value)
        for delay in self.input.tokens:
            self._running.put(None, self.checked(delay))

    def checked(self, delay: float) -> float:
        """A time that a token gives; raises ``EpicycleError`` for one below 0."""
        if not delay >= 0:
            raise EpicycleError(f"{self.input.path} is {delay:g} s, but a timer needs a time >= 0")
        return delay


class ResettableTimer(_Timing):
    """Sends a value after the number of seconds in the latest token.

    Another token before that restarts the time, a negative one stops it.  A token at the very tag at which the time is
    over comes too late to stop it.  If it is not ``preemptive``, times run one after the other: each begins when the
    previous one is over, and a negative token cancels the last waiting one, or else the running one.
    Ptolemy: ``ResettableTimer``, ``NonInterruptibleTimer`` (not preemptive).
    """

    preemptive = Parameter(bool, True, doc="whether a token restarts the time; if not, it waits until the time is over")

    def initialize(self) -> None:
        self._wake: Wake | None = None
        self._waiting: deque[float] = deque()

    def fire(self) -> None:
        if self._wake is not None and self._wake.due:
            self._wake = None
            self.output.send(self.value)
        for delay in self.input.tokens:
            if math.isnan(delay):
                raise EpicycleError(f"{self.input.path} is nan s, which is neither a time nor negative")
            if self.preemptive:
                self._stop()
                self._wake = self.wake_in(delay) if delay >= 0 else None
            elif delay >= 0:
                self._waiting.append(delay)
            elif self._waiting:
                self._waiting.pop()
            else:
                self._stop()
        if self._waiting and self._wake is None:
            self._wake = self.wake_in(self._waiting.popleft())

    def _stop(self) -> None:
        if self._wake is not None:
            self._wake.cancel()
        self._wake = None


class WaitingTime(Actor):
    """Sends how long each token of ``waiter`` has waited for a token of ``waited_for``; tokens of one tag wait for 0 s.

    Ptolemy: ``WaitingTime``, where the port is called ``waitee``.
    """

    waiter = InputPort(doc="what waits")
    waited_for = InputPort(doc="ends the waiting of all waiting tokens")
    output = OutputPort(float, doc="waiting time of each token in s, in order of arrival")

    def initialize(self) -> None:
        self._since: list[int] = []

    def fire(self) -> None:
        now = self.tag.time
        self._since += [now] * len(self.waiter.tokens)
        if self.waited_for.present:
            for time in self._since:
                self.output.send(to_seconds(now - time))
            self._since.clear()


class TimeCompare(Actor):
    """Sends the time between a token of ``first`` and one of ``second``: between the first tokens, the second ones, and
    so on.

    Ptolemy: ``TimeCompare``, where the ports are called ``input1`` and ``input2``.
    """

    first = InputPort(doc="the start of each time")
    second = InputPort(doc="the end of each time")
    output = OutputPort(float, doc="time of the second minus time of the first, in s")

    nonnegative = Parameter(bool, False, doc="whether to skip tokens of 'second' that came before their first")

    def initialize(self) -> None:
        self._firsts: deque[int] = deque()
        self._seconds: deque[int] = deque()

    def fire(self) -> None:
        for port, times in ((self.first, self._firsts), (self.second, self._seconds)):
            times.extend([self.tag.time] * len(port.tokens))
        while self._firsts and self._seconds:
            difference = self._seconds.popleft() - self._firsts[0]
            if difference >= 0 or not self.nonnegative:
                self._firsts.popleft()
                self.output.send(to_seconds(difference))


class TimeGap(Actor):
    """Sends the time since the previous token; nothing for the first one.

    Ptolemy: ``TimeGap``.
    """

    input = InputPort(doc="tokens whose time differences are sent")
    output = OutputPort(float, doc="time since the previous token, in s")

    def initialize(self) -> None:
        self._last: Tag | None = None

    def fire(self) -> None:
        for _ in self.input.tokens:
            if self._last is not None:
                self.output.send(to_seconds(self.tag.time - self._last.time))
            self._last = self.tag
