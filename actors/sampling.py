"""Actors that hand tokens on at the right moment: Sampler, MostRecent, Synchronizer.

They work channel by channel: what comes on a channel of the input leaves on the same channel of the output, so both
have equally many.  An input with one channel sends to all connections of the output.
"""

from __future__ import annotations

from collections import deque
from typing import Any

from .core import Actor, InputPort, OutputPort, Parameter, PortError


class _ByChannel(Actor):
    """What these actors share: an input and an output with channels that belong together."""

    input = InputPort(multi=True, doc="the streams")
    output = OutputPort(multi=True, doc="channel by channel what the input gets")

    def initialize(self) -> None:
        wanted, found = self.input.width, self.output.width
        if wanted > 1 and found not in (0, wanted):
            raise PortError(
                f"{self.input.path} has {wanted} channels and {self.output.path} has {found}; they must have "
                "equally many, for each channel of the input leads to one of the output"
            )

    def _send(self, token: Any, channel: int) -> None:
        if self.input.width == 1 or self.output.width == 0:
            self.output.send(token)
        else:
            self.output.send(token, channel)


class Sampler(_ByChannel):
    """Hands on what comes at the same tag as a trigger; all other tokens are lost.

    Ptolemy: ``Sampler``.
    """

    trigger = InputPort(doc="when to hand on")

    def fire(self) -> None:
        if self.trigger.present:
            for channel, tokens in enumerate(self.input.by_channel()):
                for token in tokens:
                    self._send(token, channel)


class MostRecent(_ByChannel):
    """Sends the latest token of each channel whenever it is triggered, as often as that happens.

    A channel on which no token has come yet sends ``initial``, or nothing if that is not given.
    Ptolemy: ``MostRecent``.
    """

    trigger = InputPort(doc="when to send")

    initial: Parameter[Any] = Parameter(object, None, doc="what is sent for a channel before its first token")

    def initialize(self) -> None:
        super().initialize()
        self._latest: list[Any] = [self.initial] * self.input.width

    def fire(self) -> None:
        for channel, tokens in enumerate(self.input.by_channel()):
            if tokens:
                self._latest[channel] = tokens[-1]
        for _ in self.trigger.tokens:
            for channel, token in enumerate(self._latest):
                if token is not None:
                    self._send(token, channel)


class Synchronizer(_ByChannel):
    """Waits until there is a token on every channel, and then sends one of each at the same tag.

    Tokens wait in the order of their arrival.  Ptolemy: ``Synchronizer``.
    """

    def initialize(self) -> None:
        super().initialize()
        self._waiting: list[deque[Any]] = [deque() for _ in range(self.input.width)]

    def fire(self) -> None:
        for queue, tokens in zip(self._waiting, self.input.by_channel(), strict=True):
            queue.extend(tokens)
        while all(self._waiting):
            for channel, queue in enumerate(self._waiting):
                self._send(queue.popleft(), channel)
