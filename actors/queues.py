"""Actors in which tokens wait: Queue and Server."""

from __future__ import annotations

from collections import deque
from typing import Any

from .core import (
    Actor,
    InputPort,
    OutputPort,
    Parameter,
    ParameterError,
    Pending,
    PortParameter,
    to_nanoseconds,
    to_seconds,
)
from .distributions import Distribution


class Queue(Actor):
    """Keeps tokens, first in, first out, and lets one go for each trigger.

    At one tag tokens come in before triggers let them out.  Ptolemy: ``Queue``.
    """

    input = InputPort(doc="what comes in")
    trigger = InputPort(doc="lets the first token go; does nothing if there is none")
    output = OutputPort(doc="the tokens in the order in which they came")
    size = OutputPort(int, doc="how many tokens are in it, whenever that changes")
    rejected = OutputPort(depends_on=("input",), doc="the tokens that found it full")

    capacity: Parameter[int | None] = Parameter(
        int, None, min=1, doc="how many tokens it holds; any number if left out"
    )
    persistent_trigger = Parameter(bool, False, doc="whether a trigger that finds no token waits for the next one")

    def initialize(self) -> None:
        self._tokens: deque[Any] = deque()
        self._triggers = 0

    def fire(self) -> None:
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


class Server(Actor):
    """Serves tokens in the order of their arrival, ``servers`` of them at a time, and sends each when it is done.

    The service time of a token is settled when it arrives: ``service_time`` at that tag, or drawn from
    ``distribution``.  At one tag tokens that are done leave before others come in.  In Kendall's notation
    G/G/servers/capacity.  The output does not depend on the input at once: the actor may stand in a loop.
    Ptolemy: ``Server``, which has a single server and no capacity in Kendall's sense.
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

    def fire(self) -> None:
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

    def _serve(self, token: Any, time: float) -> None:
        # What whole nanoseconds leave over is added to the next service, or it would add up while the server is busy.
        rest = time - to_seconds(to_nanoseconds(time))
        self._served.put((token, rest), time)

    def _draw(self) -> float:
        if self.distribution is None:
            return self.service_time
        return self.distribution.draw_time(self.random, "a service time")
