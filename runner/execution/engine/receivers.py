"""The parts of the ways of tokens, besides the entries of ports."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

from epicycle.actors import Emitter, EpicycleError, PortError, Receiver, counted

from .errors import ActorError, LoopError

if TYPE_CHECKING:
    from epicycle.actors import OutputPort
    from epicycle.aspects import JoinPoint, JoinPointAspect

    from ..results import Samples, Writer
    from .director import Director

Deliver = Callable[[Any], None]


class Call(Receiver):
    """Passes each token to a function: of an aspect, a recorder, a metric."""

    __slots__ = ("function",)

    def __init__(self, function: Deliver) -> None:
        self.function = function

    def put(self, token: Any) -> None:
        self.function(token)


class Recording(Receiver):
    """Appends tokens to a signal."""

    __slots__ = ("director", "samples")

    def __init__(self, samples: Samples, director: Director) -> None:
        self.samples = samples
        self.director = director

    def put(self, token: Any) -> None:
        now = self.director.now()
        self.samples.add(now.time, now.microstep, token)


class Fork(Receiver):
    """Sends each token along several ways."""

    __slots__ = ("ways",)

    def __init__(self, ways: list[Receiver]) -> None:
        self.ways = ways

    def put(self, token: Any) -> None:
        for way in self.ways:
            way.put(token)


class AspectCall(Receiver):
    """Shows each token, or job, to an aspect at a join point; an error in it is reported with what it was doing."""

    __slots__ = ("act", "aspect", "doing", "is_always_active", "point")

    def __init__(
        self, aspect: JoinPointAspect[Any, Any], act: Callable[[Any, Any], None], doing: str, point: JoinPoint
    ) -> None:
        self.aspect = aspect
        self.act = act
        self.doing = doing
        self.point = point
        self.is_always_active = aspect.is_always_active

    def put(self, token: Any) -> None:
        self.show(token, self.point)

    def show(self, token: Any, point: JoinPoint) -> None:
        """Show a token to the aspect, at its join point or the token's own."""
        doing = self.doing
        try:
            if not self.is_always_active:
                doing = "is_due()"
                if not (self.aspect.is_due(point.tag.time) and self.holds(point)):
                    doing = "pass_by()"
                    self.aspect.pass_by(token, point)
                    return
                doing = self.doing
            self.act(token, point)
        except (ActorError, LoopError):  # of something behind it
            raise
        except Exception as error:
            raise point.blame(f"{doing} at {point.port}", error) from error

    def holds(self, point: JoinPoint) -> bool:
        """Whether the ``when`` of the aspect holds for the latest tokens of its ports; not before their first ones."""
        if self.aspect.when is None:
            return True
        try:
            return bool(point.value_of(self.aspect.when))
        except EpicycleError as error:
            raise point.blame("when", error) from None


class Waits(Protocol):
    """A director, or one with its own time."""

    def later(self, delay: int, way: Receiver, token: Any) -> None:
        """Send a token onward after ``delay`` ns."""


class Delayed(Receiver):
    """Sends each token onward after a delay."""

    __slots__ = ("delay", "director", "onward")

    def __init__(self, director: Waits, delay: int, onward: Receiver) -> None:
        self.director = director
        self.delay = delay
        self.onward = onward

    def put(self, token: Any) -> None:
        self.director.later(self.delay, self.onward, token)


class Channels(Protocol):
    """Makes ways along single wires."""

    def along(self, port: OutputPort[Any], channel: int) -> Sender:
        """The sender over one of the channels of a port."""


class Sender(Emitter):
    """The effect of ``send`` at an output port: a token is logged, and sent along all channels or one.

    ``channels`` makes the way along one of them, with the writer of its log records.
    """

    __slots__ = ("channels", "director", "onward", "port", "single", "writer")

    def __init__(
        self,
        port: OutputPort[Any],
        director: Director,
        writer: Writer,
        onward: Receiver,
        channels: Channels,
    ) -> None:
        self.port = port
        self.director = director
        self.writer = writer
        self.onward = onward
        self.channels = channels
        self.single: dict[int, Sender] | None = None  # made when the first token takes them: few ever do

    def put(self, token: Any) -> None:
        present = self.director.present
        self.writer.write(self.director.tag if present is None else present, token)
        self.onward.put(token)

    def to(self, channel: int) -> Sender:
        """The sender to one channel."""
        if self.single is None:
            self.single = {}
        sender = self.single.get(channel)
        if sender is None:
            width = self.port.width
            if not 0 <= channel < width:
                known = f"it has {counted(width, 'channel')}, counted from 0"
                raise PortError(f"{self.port.path} has no channel {channel}: {known}")
            sender = self.single[channel] = self.channels.along(self.port, channel)
        return sender


class WovenSender(Emitter):
    """A sender behind aspects: what they drop has not been sent.

    The channel of a send travels past them in the way behind, for they may forward it later.
    """

    __slots__ = ("entries", "sender", "woven")

    def __init__(self, sender: Sender, woven: Callable[[Receiver], Receiver]) -> None:
        self.sender = sender
        self.woven = woven
        self.entries: dict[int | None, Receiver] = {}

    def put(self, token: Any) -> None:
        self.to(None).put(token)

    def to(self, channel: int | None) -> Receiver:
        """The way to all channels, or to one."""
        entry = self.entries.get(channel)
        if entry is None:
            onward: Receiver = self.sender if channel is None else Call(partial(self._send, channel))
            entry = self.entries[channel] = self.woven(onward)
        return entry

    def _send(self, channel: int, token: Any) -> None:
        self.sender.to(channel).put(token)


def all_of(ways: list[Receiver]) -> Receiver:
    """A single way along all of them."""
    return ways[0] if len(ways) == 1 else Fork(ways)
