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
    below_nanoseconds,
    present,
    rounds,
)
from .distributions import Distribution


class Queue(Actor):
    """Keeps tokens, first in, first out, and releases one for each trigger.

    At one tag, tokens come in before triggers release them.  Ptolemy: ``Queue``.
    """

    input = InputPort(doc="tokens to keep")
    trigger = InputPort(multi=True, required=False, doc="releases the first token; does nothing if there is none")
    output = OutputPort(doc="the tokens in order of arrival")
    size = OutputPort(int, doc="number of tokens in the queue, whenever it changes")
    rejected = OutputPort(depends_on=("input",), doc="tokens that found the queue full")

    capacity = Parameter(int, None, min=1, doc="most tokens that the queue holds; unlimited if left out")
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


class SharedQueue(Actor):
    """One queue for several consumers: a channel of ``trigger`` requests a token, and gets it on the same channel of
    ``output``.

    Each consumer has requested one at the start.  A token goes to the first waiting consumer; if none waits, it is
    kept, first in, first out.  At one tag, requests are handled before tokens come in.  Ptolemy: ``SharedQueue``.
    """

    input = InputPort(doc="tokens to keep")
    trigger = InputPort(multi=True, required=False, doc="requests a token for its channel")
    output = OutputPort(multi=True, doc="a channel for each consumer, in the order of the triggers")
    size = OutputPort(int, doc="number of tokens in the queue, after each firing")
    rejected = OutputPort(depends_on=("input",), doc="tokens that found the queue full")

    capacity = Parameter(int, None, min=1, doc="most tokens that the queue holds; unlimited if left out")

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
    """Serves tokens in the order of their arrival, ``servers`` of them at a time, and sends each when its service ends.

    The service time of a token is determined when it arrives: ``service_time`` at that tag, or drawn from
    ``distribution``.  At one tag, served tokens leave before others come in.  In Kendall's notation
    G/G/servers/capacity.  The output does not depend on the input within the same tag, so the actor may be part of a
    loop.  Ptolemy: ``Server``.
    """

    input = InputPort(doc="tokens to serve")
    output = OutputPort(depends_on=(), doc="each token when its service ends")
    # A token is handled when its service time is known, so these outputs wait for both inputs.
    size = OutputPort(
        int, depends_on=("input", "service_time"), doc="number of tokens that wait or are served, whenever it changes"
    )
    rejected = OutputPort(depends_on=("input", "service_time"), doc="tokens that found no place")

    service_time = PortParameter(float, 1.0, unit="s", min=0, doc="duration of a service")
    distribution = Parameter(Distribution, None, unit="s", doc="distribution of service times, instead of service_time")
    servers = Parameter(int, 1, min=1, optional=True, doc="number of tokens served at a time; unlimited if null")
    capacity = Parameter(int, None, min=1, doc="most tokens that may wait or be served; unlimited if left out")

    def check(self) -> None:
        if self.capacity is not None and (self.servers is None or self.capacity < self.servers):
            servers = "unlimited" if self.servers is None else self.servers
            raise ParameterError(
                f"capacity: {self.capacity} is less than 'servers' ({servers}), but it includes tokens in service"
            )
        if self.distribution is not None and self.distribution.token_type not in (int, float):
            raise ParameterError(f"distribution: {type(self.distribution).__name__} gives values other than numbers")

    def initialize(self) -> None:
        self._served: Pending[tuple[Any, float]] = Pending(self)  # a token, and its remaining time
        self._waiting: deque[tuple[Any, float]] = deque()
        self._size = 0  # tokens that wait or are served

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
            if self.servers is None or self._size - len(self._waiting) < self.servers:
                self._serve(token, self.draw_time())
            else:
                self._waiting.append((token, self.draw_time()))
            self._size += 1
            self.size.send(self._size)

    def _serve(self, token: Any, time: float) -> None:
        self._served.put((token, below_nanoseconds(time)), time)

    def draw_time(self) -> float:
        """The service time of a token that arrives now."""
        if self.distribution is None:
            return self.service_time
        return self.distribution.draw_time(self.random, "a service time")
