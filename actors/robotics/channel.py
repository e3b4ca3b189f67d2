"""How messages reach the other robots."""

from __future__ import annotations

from typing import Any

from ..core import Actor, EpicycleError, InputPort, OutputPort, counted


class ChannelError(EpicycleError):
    """A broadcast channel whose ends do not match."""


class BroadcastChannel(Actor):
    """Hands what one participant says to all the others.

    The n-th connection into ``input`` and the n-th out of ``output`` belong to the same participant.
    """

    input = InputPort(Any, multi=True, doc="from each participant")
    output = OutputPort(Any, multi=True, doc="to each participant, what the others said")

    def initialize(self) -> None:
        if self.input.width != self.output.width:
            raise ChannelError(
                f"{self.path} has {counted(self.input.width, 'connection')} into 'input' "
                f"but {self.output.width} out of 'output'; "
                "connect both once for each participant, in the same order"
            )

    def fire(self) -> None:
        send, listeners = self.output.send, range(self.output.width)
        for speaker, tokens in enumerate(self.input.by_channel()):
            for token in tokens:
                for listener in listeners:
                    if listener != speaker:
                        send(token, listener)
