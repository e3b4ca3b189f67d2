"""The parts of which the ways of tokens are made, beside the entries of ports."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

from epicycle.actors import Emitter, PortError, Way, counted

if TYPE_CHECKING:
    from ..results import Writer
    from .director import Director

Deliver = Callable[[Any], None]


class Call(Way):
    """Hands each token to a function: of an aspect, a recorder, a metric."""

    __slots__ = ("function",)

    def __init__(self, function: Deliver) -> None:
        self.function = function

    def go(self, token: Any) -> None:
        self.function(token)


class Fork(Way):
    """Lets each token go on by several ways."""

    __slots__ = ("ways",)

    def __init__(self, ways: list[Way]) -> None:
        self.ways = ways

    def go(self, token: Any) -> None:
        for way in self.ways:
            way.go(token)


class Waits(Protocol):
    """A director, or one with a time of its own."""

    def later(self, delay: int, way: Way, token: Any) -> None:
        """Let a token go on after ``delay`` ns."""


class Delayed(Way):
    """Lets each token go on after a time."""

    __slots__ = ("delay", "director", "onward")

    def __init__(self, director: Waits, delay: int, onward: Way) -> None:
        self.director = director
        self.delay = delay
        self.onward = onward

    def go(self, token: Any) -> None:
        self.director.later(self.delay, self.onward, token)


class Sender(Emitter):
    """What ``send`` does at an output port: a token is logged, and goes on by all channels or by one.

    ``channels`` makes the way along one channel, with what logs its sends; ``width`` is their number.
    """

    __slots__ = ("channels", "director", "onward", "path", "single", "width", "writer")

    def __init__(
        self,
        path: str,
        director: Director,
        writer: Writer,
        onward: Way,
        channels: Callable[[int], Sender],
        width: int,
    ) -> None:
        self.path = path
        self.director = director
        self.writer = writer
        self.onward = onward
        self.channels = channels
        self.width = width
        self.single: dict[int, Sender] = {}  # made when the first token takes them: few ever do

    def go(self, token: Any) -> None:
        present = self.director.present
        self.writer.write(self.director.tag if present is None else present, token)
        self.onward.go(token)

    def send(self, token: Any, channel: int | None = None) -> None:
        """Send a token to all channels, or to one."""
        if channel is None:
            self.go(token)
        else:
            self.to(channel).go(token)

    def to(self, channel: int) -> Sender:
        """What sends to one channel."""
        sender = self.single.get(channel)
        if sender is None:
            if not 0 <= channel < self.width:
                known = f"it has {counted(self.width, 'channel')}, counted from 0"
                raise PortError(f"{self.path} has no channel {channel}: {known}")
            sender = self.single[channel] = self.channels(channel)
        return sender


class Screened(Emitter):
    """A sender behind aspects: what they drop has not been sent.

    The channel of a send travels past them in the way behind, for they may forward it later.
    """

    __slots__ = ("entries", "sender", "woven")

    def __init__(self, sender: Sender, woven: Callable[[Way], Way]) -> None:
        self.sender = sender
        self.woven = woven
        self.entries: dict[int | None, Way] = {}

    def send(self, token: Any, channel: int | None = None) -> None:
        """Send a token to all channels, or to one."""
        entry = self.entries.get(channel)
        if entry is None:
            onward: Way = self.sender if channel is None else Call(partial(self.sender.send, channel=channel))
            entry = self.entries[channel] = self.woven(onward)
        entry.go(token)


def all_of(ways: list[Way]) -> Way:
    """One way that takes all of them."""
    return ways[0] if len(ways) == 1 else Fork(ways)
