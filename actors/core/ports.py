"""Ports: the typed ends of wires.  Declared on an actor's class, bound to each of its instances.

An input port holds the tokens of the present tag and nothing else: after the actor has fired they are gone.  One that
keeps them (``keep``) holds all that have not been taken out yet.
An output port hands a token on at once; who gets it, and through which delays and aspects, is the engine's matter.
"""

from __future__ import annotations

import types
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Generic

from .errors import EpicycleError
from .port_types import shaped, type_name
from .primitives import empty

if TYPE_CHECKING:
    from typing_extensions import TypeVar

    T = TypeVar("T", default=Any)
else:
    from typing import TypeVar

    T = TypeVar("T")

_ANY: Any = Any


class PortError(EpicycleError):
    """A port was read or written in a way that its declaration or the model does not allow."""


class Way:
    """Where a token goes on to."""

    __slots__ = ()

    def go(self, token: Any) -> None:
        """Let a token go on."""
        raise NotImplementedError


class Emitter(Way):
    """What ``send`` does in a running model."""

    __slots__ = ()

    def send(self, token: Any, channel: int | None = None) -> None:
        """Send a token to all channels, or to one."""
        raise NotImplementedError


class _Told(Emitter):
    """Hands what is sent to a function."""

    __slots__ = ("function",)

    def __init__(self, function: Callable[..., None]) -> None:
        self.function = function

    def send(self, token: Any, channel: int | None = None) -> None:
        self.function(token, channel)


class Port(Generic[T]):
    """What both directions share: the declaration, and where the instance stands."""

    __slots__ = ("actor", "doc", "multi", "name", "path", "ptolemy", "type", "width")

    direction = ""

    def __init__(
        self,
        type: Any,
        *,
        shape: tuple[int | None, ...] | None,
        multi: bool,
        ptolemy: Mapping[str, object] | None,
        doc: str,
    ) -> None:
        self.type = type if shape is None else shaped(type, shape)
        self.multi = multi
        self.ptolemy = ptolemy
        self.doc = doc
        self.name = ""
        self.path = ""
        self.actor: Any = None
        self.width = 0

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def bind(self, actor: Any) -> Any:
        """The port of one instance."""
        bound = type(self).__new__(type(self))
        self.tell(bound)
        bound.actor = actor
        bound.path = f"{actor.path}.{self.name}"
        return bound

    def tell(self, bound: Any) -> None:
        """Give what is declared to the port of an instance."""
        bound.type, bound.multi, bound.doc, bound.name = self.type, self.multi, self.doc, self.name
        bound.ptolemy, bound.width = self.ptolemy, 0

    def follow_ptolemy(self) -> None:
        """Engine: the port is as it is in Ptolemy, where the declaration says how."""
        for option, value in (self.ptolemy or {}).items():
            setattr(self, option, value)

    def __repr__(self) -> str:
        return f"<{self.direction} port {self.path or self.name}: {type_name(self.type)}>"


class InputPort(Port[T]):
    """Where tokens arrive: of any type if none is given.

    ``shape`` is that of a ``numpy`` array, as for parameters: ``(2,)`` a pair, ``(None, 2)`` rows of pairs.
    ``required``: the model is wrong when nothing is connected to it.  ``multi``: any number of connections, each a
    channel, in the order in which they are declared.  ``triggers``: a token makes the actor do its work; if not, the
    actor only takes note of it, which takes no time, and works with it later.  ``keep``: a token stays until ``get``
    takes it out; as long as a firing takes some out and leaves others, the actor fires again at the same tag.
    ``ptolemy`` are the options that are others under a director with ``like: ptolemy``: ``ptolemy={"keep": True}``.
    """

    __slots__ = ("arrived", "channels", "keep", "kept", "required", "shown", "triggers")

    direction = "input"

    if TYPE_CHECKING:
        arrived: list[Any]
        channels: list[int] | None  # of these tokens, where there are several connections
        shown: list[Any]  # the same as arrived, or nothing while they are hidden

    def __init__(
        self,
        type: type[T] | types.UnionType = _ANY,
        *,
        shape: tuple[int | None, ...] | None = None,
        multi: bool = False,
        required: bool = True,
        triggers: bool = True,
        keep: bool = False,
        ptolemy: Mapping[str, object] | None = None,
        doc: str = "",
    ) -> None:
        Port.__init__(self, type, shape=shape, multi=multi, ptolemy=ptolemy, doc=doc)
        self.required = required
        self.triggers = triggers
        self.keep = keep
        self.prepare()

    def tell(self, bound: Any) -> None:
        Port.tell(self, bound)
        bound.required, bound.triggers, bound.keep = self.required, self.triggers, self.keep
        bound.prepare()

    @property
    def present(self) -> bool:
        """Whether a token has arrived at the present tag, or waits if the port keeps tokens."""
        return bool(self.shown)

    @property
    def value(self) -> T:
        """The token of the present tag, the latest if there are several; raises ``PortError`` if there is none."""
        if not self.shown:
            raise PortError(f"{self.path} has no token at this tag; ask 'present' before 'value'")
        token: T = self.shown[-1]
        return token

    @property
    def tokens(self) -> tuple[T, ...]:
        """All tokens of the present tag in the order of their arrival."""
        return tuple(self.shown)

    def by_channel(self) -> list[list[T]]:
        """The tokens of the present tag, a list for each channel."""
        if self.width == 1:
            return [list(self.shown)]
        result: list[list[T]] = [[] for _ in range(self.width)]
        for token, channel in zip(self.shown, self.channels or (), strict=False):
            result[channel].append(token)
        return result

    def waiting(self, channel: int = 0) -> int:
        """How many tokens of a channel have not been taken out yet."""
        if self.width <= 1:
            return 0 if channel else len(self.shown)
        return (self.channels or []).count(channel) if self.shown else 0

    def get(self, channel: int = 0) -> T:
        """Take out the first token of a channel, of a port that keeps them; raises ``PortError`` if there is none."""
        if not self.waiting(channel):
            raise PortError(f"{self.path} has no token on channel {channel}; ask 'waiting' before 'get'")
        place = 0
        if self.channels is not None:
            place = self.channels.index(channel)
            del self.channels[place]
        self.kept -= place < self.kept
        token: T = self.arrived.pop(place)
        return token

    def receive(self, token: Any, channel: int) -> None:
        """Engine: a token arrives."""
        self.arrived.append(token)
        if self.width > 1:
            if self.channels is None:
                self.channels = []
            self.channels.append(channel)

    def prepare(self) -> None:
        """Make room: no token has come yet."""
        self.arrived = self.shown = []
        self.channels = None
        self.kept = 0

    def clear(self) -> None:
        """Engine: forget what has come."""
        empty(self.arrived)
        if self.channels is not None:
            empty(self.channels)
        self.shown = self.arrived

    @property
    def has_new(self) -> bool:
        """Engine: whether something has come since the actor fired last."""
        return len(self.arrived) > self.kept

    def take(self) -> tuple[list[Any], list[int]]:
        """Engine: take out the tokens that have come since the actor fired last, as if they had not come yet."""
        taken = self.arrived[self.kept :], [] if self.channels is None else self.channels[self.kept :]
        del self.arrived[self.kept :]
        if self.channels is not None:
            del self.channels[self.kept :]
        self.shown = self.arrived
        return taken

    def give(self, taken: tuple[list[Any], list[int]]) -> None:
        """Engine: show tokens that were taken out, behind those that the port keeps."""
        self.arrived = self.arrived[: self.kept] + taken[0]
        self.channels = (self.channels or [])[: self.kept] + taken[1] or None
        self.shown = self.arrived


class OutputPort(Port[T]):
    """Where tokens leave: of any type if none is given.

    ``depends_on`` names the inputs that a token may depend on within the same tag; ``None`` means all of them, ``()``
    none (an actor that delays), which lets the port stand in a loop.  ``ptolemy`` is as for inputs.
    """

    __slots__ = ("depends_on", "emitter")

    direction = "output"

    def __init__(
        self,
        type: type[T] | types.UnionType = _ANY,
        *,
        shape: tuple[int | None, ...] | None = None,
        multi: bool = False,
        depends_on: tuple[str, ...] | None = None,
        ptolemy: Mapping[str, object] | None = None,
        doc: str = "",
    ) -> None:
        Port.__init__(self, type, shape=shape, multi=multi, ptolemy=ptolemy, doc=doc)
        self.depends_on = depends_on
        self.emitter: Emitter | None = None

    def tell(self, bound: Any) -> None:
        Port.tell(self, bound)
        bound.depends_on, bound.emitter = self.depends_on, None

    def send(self, token: T, channel: int | None = None) -> None:
        """Send a token at the present tag: to all channels, or to the one given."""
        if self.emitter is None:
            raise PortError(
                f"{self.path or self.name} cannot send now: tokens are sent in fire() or run() of a running model"
            )
        self.emitter.send(token, channel)

    def connect(self, emit: Emitter | Callable[..., None]) -> None:
        """Engine: what ``send`` does from now on; a function is given token and channel."""
        self.emitter = emit if isinstance(emit, Emitter) else _Told(emit)

    def disconnect(self) -> None:
        """Engine: from now on nothing can be sent."""
        self.emitter = None
