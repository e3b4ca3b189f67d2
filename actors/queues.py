"""Actors in which tokens wait: Queue, SharedQueue and Server."""

from __future__ import annotations

from collections import deque
from typing import Any

from .core import (
    ABSENT,
    Actor,
    InputPort,
    OutputPort,
    Parameter,
    ParameterError,
    Pending,
    PortParameter,
    present,
    rounds,
    to_nanoseconds,
    to_seconds,
)
from .distributions import Distribution
from .matching import taken


class Queue(Actor):
    """Keeps tokens, first in, first out, and lets one go for each trigger.

    At one tag tokens come in before triggers let them out.  With ``one_at_a_time``, as in Ptolemy, a firing takes one
    token and one trigger, of which all channels together are one, and tells ``size`` at its end, changed or not; one
    trigger waits at most; ``output`` does not depend on ``input`` at once, though a token may pass at once.  What comes
    together with a trigger to a full queue counts in ``size`` there, and is lost; what comes on another channel of
    ``trigger`` than the first alone waits for the next firing.  Ptolemy: ``Queue``.
    """

    input = InputPort(doc="what comes in")
    trigger = InputPort(multi=True, required=False, doc="lets the first token go; does nothing if there is none")
    output = OutputPort(ptolemy={"depends_on": ("trigger",)}, doc="the tokens in the order in which they came")
    size = OutputPort(int, doc="how many tokens are in it, whenever that changes")
    rejected = OutputPort(depends_on=("input",), doc="the tokens that found it full")

    capacity: Parameter[int | None] = Parameter(
        int, None, min=1, doc="how many tokens it holds; any number if left out"
    )
    persistent_trigger = Parameter(bool, False, doc="whether a trigger that finds no token waits for the next one")
    one_at_a_time = Parameter(
        bool, False, ptolemy=True, doc="whether a firing takes one token and one trigger, and tells size once"
    )

    def check(self) -> None:
        self.input.keep = self.trigger.keep = self.one_at_a_time

    def initialize(self) -> None:
        self._tokens: deque[Any] = deque()
        self._triggers = 0

    def fire(self) -> None:
        if self.one_at_a_time:
            if self.input.waiting() or self.trigger.waiting():
                tokens = [self.input.get()] if self.input.waiting() else []
                self._take(tokens, taken(self.trigger) > 0)
            return
        for token in self.input.tokens:
            if self.capacity is not None and len(self._tokens) >= self.capacity:
                self.rejected.send(token)
            else:
                self._tokens.append(token)
                self.size.send(len(self._tokens))
        self._triggers += len(self.trigger.tokens)
        while self._triggers and self._tokens:
            self._triggers -= 1
            self.output.send(self._tokens.popleft())
            self.size.send(len(self._tokens))
        if not self.persistent_trigger:
            self._triggers = 0

    def _take(self, tokens: list[Any], is_triggered: bool) -> None:
        """Take a token, if there is one, and let one go."""
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


class SharedQueue(Actor):
    """One line for several: a channel of ``trigger`` asks for a token, and gets it by the channel of ``output``.

    Each has asked for one at the start.  A token goes to the first that waits; if nobody does it is kept, first in,
    first out.  At one tag those who ask come before what comes in.  Ptolemy: ``SharedQueue``.
    """

    input = InputPort(doc="what comes in")
    trigger = InputPort(multi=True, required=False, doc="asks for a token, by channel")
    output = OutputPort(multi=True, doc="a channel for each who asks, in the order of the triggers")
    size = OutputPort(int, doc="how many tokens are in it, behind each firing")
    rejected = OutputPort(depends_on=("input",), doc="the tokens that found it full")

    capacity: Parameter[int | None] = Parameter(
        int, None, min=1, doc="how many tokens it holds; any number if left out"
    )

    def initialize(self) -> None:
        self._tokens: deque[Any] = deque()
        self._asking = [True] * self.output.width

    def fire(self) -> None:
        for triggers, arrived in rounds(self.trigger, self.input):
            for channel, trigger in enumerate(triggers):
                if trigger is ABSENT or channel >= self.output.width:
                    continue
                self._asking[channel] = not self._tokens
                if self._tokens:
                    self.output.send(self._tokens.popleft(), channel)
            for token in present(arrived):
                self._take(token)
            self.size.send(len(self._tokens))

    def _take(self, token: Any) -> None:
        if True in self._asking:
            channel = self._asking.index(True)
            self._asking[channel] = False
            self.output.send(token, channel)
        elif self.capacity is not None and len(self._tokens) >= self.capacity:
            self.rejected.send(token)
        else:
            self._tokens.append(token)


class Server(Actor):
    """Serves tokens in the order of their arrival, ``servers`` of them at a time, and sends each when it is done.

    The service time of a token is settled when it arrives: ``service_time`` at that tag, or drawn from
    ``distribution``.  At one tag tokens that are done leave before others come in.  In Kendall's notation
    G/G/servers/capacity.  The output does not depend on the input at once: the actor may stand in a loop.

    With ``one_at_a_time`` and a single server, as in Ptolemy, a firing takes one token and lets one go whose time is
    over, and tells ``size`` at its end, changed or not.  Ptolemy: ``Server``.
    """

    input = InputPort(doc="what is to be served")
    output = OutputPort(depends_on=(), doc="each token when its service is over")
    # What comes in is dealt with when its service time is known, so what is said of it waits for both.
    size = OutputPort(int, depends_on=("input", "service_time"), doc="how many are in it, whenever that changes")
    rejected = OutputPort(depends_on=("input", "service_time"), doc="the tokens that found no place")

    service_time = PortParameter(float, 1.0, unit="s", min=0, doc="how long a service takes")
    distribution: Parameter[Distribution | None] = Parameter(
        Distribution, None, unit="s", doc="what service times are drawn from, in place of service_time"
    )
    servers: Parameter[int | None] = Parameter(
        int, 1, min=1, optional=True, doc="how many are served at a time; any number if null"
    )
    capacity: Parameter[int | None] = Parameter(
        int, None, min=1, doc="how many may wait and be served in all; any number if left out"
    )
    one_at_a_time = Parameter(
        bool, False, ptolemy=True, doc="whether a firing takes one token and lets one go, and tells size once"
    )

    def check(self) -> None:
        if self.capacity is not None and (self.servers is None or self.capacity < self.servers):
            servers = "any number of" if self.servers is None else self.servers
            raise ParameterError(
                f"capacity: {self.capacity} is less than {servers} servers; it counts those that are served as well"
            )
        if self.distribution is not None and self.distribution.token_type not in (int, float):
            raise ParameterError(f"distribution: {type(self.distribution).__name__} does not give numbers alone")

    def initialize(self) -> None:
        self._served: Pending[tuple[Any, float]] = Pending(self)  # a token, and what is left of its time
        self._waiting: deque[tuple[Any, float]] = deque()
        self._size = 0  # those that wait and those that are served
        self._free: int | None = None  # when the one is done that is served, one at a time
        self._rest = 0.0

    def fire(self) -> None:
        if self.one_at_a_time and self.servers == 1:
            for token in self.input.tokens or (ABSENT,):
                self._take(token)
            return
        for token, rest in self._served.due():
            self._size -= 1
            self.output.send(token)
            self.size.send(self._size)
            if self._waiting:
                waiting, time = self._waiting.popleft()
                self._serve(waiting, time + rest)
        for token in self.input.tokens:
            if self.capacity is not None and self._size >= self.capacity:
                self.rejected.send(token)
                continue
            if self.servers is None or len(self._served) < self.servers:
                self._serve(token, self._draw())
            else:
                self._waiting.append((token, self._draw()))
            self._size += 1
            self.size.send(self._size)

    def _take(self, token: Any) -> None:
        """Take a token, if there is one, and let one go whose time is over."""
        if token is not ABSENT and self.capacity is not None and len(self._waiting) >= self.capacity:
            self.rejected.send(token)
        elif token is not ABSENT:
            self._waiting.append((token, self._draw()))
        rest = 0.0
        if self._waiting and self._free == self.tag.time:
            self._free, rest = None, self._rest
            self.output.send(self._waiting.popleft()[0])
        self.size.send(len(self._waiting))
        if self._waiting and self._free is None:
            time = self._waiting[0][1] + rest
            self._free = self.tag.time + to_nanoseconds(time)
            self.wake_in(time)
            self._rest = time - to_seconds(to_nanoseconds(time))

    def _serve(self, token: Any, time: float) -> None:
        # What whole nanoseconds leave over is added to the next service, or it would add up while the server is busy.
        rest = time - to_seconds(to_nanoseconds(time))
        self._served.put((token, rest), time)

    def _draw(self) -> float:
        if self.distribution is None:
            return self.service_time
        return self.distribution.draw_time(self.random, "a service time")
