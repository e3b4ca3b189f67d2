"""Queues, delays and timers: in Ptolemy a firing takes one token and sends one."""

from __future__ import annotations

from bisect import insort
from collections import deque
from typing import Any

from epicycle import actors, aspects
from epicycle.actors import ABSENT, OutputPort, Tag, below_nanoseconds, to_nanoseconds
from epicycle.aspects import Task

from .changing import Singly, but, preset


class Queue(Singly, actors.Queue):
    """Keeps tokens, and releases the first for a trigger; a firing takes one token and one trigger.

    ``size`` is sent at the end of each firing, changed or not.  All channels of the trigger count as one, and at most
    one trigger waits.  ``output`` does not depend on ``input`` within the same tag, although a token may pass at once.
    A token that comes to a full queue together with a trigger is included in ``size``, and lost; a trigger that comes
    only on a channel other than the first waits for the next firing.
    """

    output: OutputPort[Any] = but(actors.Queue.output, depends_on=("trigger",))

    def is_ready(self) -> bool:
        return self._waiting.has(self.input) or self._waiting.has(self.trigger)

    def fire_once(self) -> None:
        tokens, is_triggered = list(self.input.tokens), self.trigger.present
        if not tokens and not is_triggered:
            return
        is_full = self.capacity is not None and len(self._tokens) >= self.capacity
        size = len(self._tokens) + (bool(tokens) and (is_triggered or not is_full))
        if (is_triggered or (self._triggers and tokens)) and size:
            self._triggers = 0
            size -= 1
            self.output.send(self._tokens.popleft() if self._tokens else tokens.pop())
        elif is_triggered:
            self._triggers = int(self.persistent_trigger)
        for token in tokens:
            if is_full:
                self.rejected.send(token)
            else:
                self._tokens.append(token)
        self.size.send(size)


class Server(actors.Server):
    """Serves tokens in the order of their arrival; a single server takes one and releases one per firing.

    ``size`` is then sent at the end of each firing, changed or not.
    """

    def initialize(self) -> None:
        super().initialize()
        self._line: deque[tuple[Any, float]] = deque()  # tokens and their service times, of a single server
        self._free: int | None = None  # when the present service ends
        self._rest = 0.0

    def fire(self) -> None:
        if self.servers != 1:
            super().fire()
            return
        for token in self.input.tokens or (ABSENT,):
            self._take(token)

    def _take(self, token: Any) -> None:
        """Take a token, if there is one, and release one whose service has ended."""
        if token is not ABSENT and self.capacity is not None and len(self._line) >= self.capacity:
            self.rejected.send(token)
        elif token is not ABSENT:
            self._line.append((token, self.draw_time()))
        rest = 0.0
        if self._line and self._free == self.tag.time:
            self._free, rest = None, self._rest
            self.output.send(self._line.popleft()[0])
        self.size.send(len(self._line))
        if self._line and self._free is None:
            time = self._line[0][1] + rest
            self._free = self.tag.time + to_nanoseconds(time)
            self.wake_in(time)
            self._rest = below_nanoseconds(time)


class TimeDelay(actors.TimeDelay):
    """Sends each token after a delay, with its microstep; those due at one time leave at successive microsteps.

    In each firing, at most one due token leaves; the others are tried again at the next microstep.  Among tokens that
    leave at the same time, a new one is the last, or the first if its microstep is below that of the last.
    """

    def initialize(self) -> None:
        self._line: list[tuple[Tag, Any]] = []  # in the order in which they leave

    def fire(self) -> None:
        now, line, tokens, due = self.tag, self._line, self.input.tokens, list[Any]()
        while line and line[0][0] <= now and len(due) < max(1, len(tokens)):
            due.append(line.pop(0)[1])
        if line and line[0][0].time <= now.time:
            self.wake_in(0)
        for token in due:
            self.output.send(token)
        for token in tokens:
            self._put(token)

    def _put(self, token: Any) -> None:
        now, wake, line = self.tag, self.wake_in(self.delay), self._line
        tag = Tag(wake.time, now.microstep if wake.time > now.time else wake.microstep)
        is_last = not line or tag.microstep >= line[-1][0].microstep
        place = len(line)
        while place and (line[place - 1][0].time > tag.time or (line[place - 1][0].time == tag.time and not is_last)):
            place -= 1
        line.insert(place, (tag, token))


class Timer(actors.Timer):
    """Sends a value after the number of seconds in each token; those due at one time at successive microsteps."""

    def initialize(self) -> None:
        self._ends: list[int] = []  # ascending

    def fire(self) -> None:
        for delay in self.input.tokens or (None,):
            self._take(delay)

    def _take(self, delay: float | None) -> None:
        """Send one value that is due, and take a token, if there is one."""
        now = self.tag.time
        if self._ends and self._ends[0] == now:
            del self._ends[0]
            self.output.send(self.value)
        if self._ends and self._ends[0] == now:
            self.wake_in(0)
        if delay is not None:
            self.wake_in(self.checked(delay))
            insort(self._ends, now + to_nanoseconds(delay))


class Merge(actors.Merge):
    """Joins the tokens of all its channels; all that wait on one channel leave at once."""

    def initialize(self) -> None:
        super().initialize()
        self._left: Tag | None = None  # the tag at which a channel was sent and others had to wait

    def fire(self) -> None:
        self._waiting.come()
        first = next((queue for queue in self._waiting.channels if queue), None)
        if first is None or self._left == self.tag:
            return
        while first:
            self.output.send(first.popleft())
        if self.discard:
            for queue in self._waiting.channels:
                queue.clear()
        elif any(self._waiting.channels):
            self._left = self.tag
            self.wake_in(0)


class Clock(actors.Clock):
    """Ticks at fixed times; a start restores the period given in the model."""

    reset_period = preset(actors.Clock.reset_period, True)


class _Steps(aspects.Server):
    """A server of which a task that takes no time takes a microstep."""

    def is_instant(self, task: Task) -> bool:
        return False


class Bus(aspects.Bus):
    """Carries one message at a time; one that takes no time takes a microstep."""

    def server(self) -> aspects.Server:
        return _Steps()
