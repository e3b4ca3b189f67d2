"""Ports: the typed ends of wires.  They are declared on an actor's class and bound to each instance.

An input port holds only the tokens of the present tag: after the actor has fired they are gone. An output port passes
a token on at once; the engine knows the receivers, delays and aspects.
"""

from __future__ import annotations

import types
from collections.abc import Callable
from operator import itemgetter
from typing import TYPE_CHECKING, Any, ClassVar, Generic

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
_FIRST: Any = itemgetter(0)
NO_TOKENS: list[Any] = []  # of all ports at which no token has arrived; nothing is added to it


class PortError(EpicycleError):
    """A port was used in a way that its declaration or the model does not allow."""


class Receiver:
    """The next place of a token."""

    __slots__ = ()

    def put(self, token: Any) -> None:
        """Pass a token on."""
        raise NotImplementedError


class Emitter(Receiver):
    """What ``send`` does in a running model: ``put`` sends a token to all channels."""

    __slots__ = ()

    def to(self, channel: int) -> Receiver:
        """The way to one channel."""
        raise NotImplementedError


class _Told(Emitter):
    """Passes sent tokens to a function."""

    __slots__ = ("channel", "function")

    def __init__(self, function: Callable[..., None], channel: int | None = None) -> None:
        self.function = function
        self.channel = channel

    def put(self, token: Any) -> None:
        self.function(token, self.channel)

    def to(self, channel: int) -> Receiver:
        return _Told(self.function, channel)


class Terms:
    """What is declared of a port: the same object for the port of an actor class and those of all its instances."""

    __slots__ = ("depends_on", "doc", "independent_of", "multi", "name", "required", "triggers", "type")

    def __init__(self, type: Any, multi: bool, doc: str) -> None:
        self.name = ""
        self.type = type
        self.multi = multi
        self.doc = doc
        self.required = self.triggers = False  # of inputs
        self.depends_on: tuple[str, ...] | None = None  # of outputs
        self.independent_of: tuple[str, ...] = ()

    def but(self, option: str, value: object) -> Terms:
        """The same, except for one of them."""
        made = Terms(self.type, self.multi, self.doc)
        made.name, made.depends_on, made.independent_of = self.name, self.depends_on, self.independent_of
        made.required, made.triggers = self.required, self.triggers
        setattr(made, option, value)
        return made


V = TypeVar("V")


class _Term(Generic[V]):
    """One of the terms, as an attribute of a port; when it is set, it changes for this port alone."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __get__(self, port: Any, owner: object) -> V:
        term: V = getattr(port.terms, self.name)
        return term

    def __set__(self, port: Any, value: V) -> None:
        port.change(self.name, value)


class Port(Generic[T]):
    """The common part of both directions: the declaration, and the place of the instance."""

    __slots__ = ("actor", "path", "terms", "width")

    copies_share: ClassVar[tuple[str, ...]] = ("terms",)  # attributes that copies of a run share

    direction = ""

    name = _Term[str]("name")
    type = _Term[Any]("type")
    multi = _Term[bool]("multi")
    doc = _Term[str]("doc")

    def __init__(
        self,
        type: Any,
        *,
        shape: tuple[int | None, ...] | None,
        multi: bool,
        doc: str,
    ) -> None:
        self.terms = Terms(type if shape is None else shaped(type, shape), multi, doc)
        self.path = ""
        self.actor: Any = None
        self.width = 0

    def __set_name__(self, owner: object, name: str) -> None:
        self.name = name

    def change(self, option: str, value: object) -> None:
        """Change one of the terms for this port alone."""
        if getattr(self.terms, option) != value:
            self.terms = self.terms.but(option, value)

    def bind(self, actor: Any) -> Any:
        """The port of one instance."""
        bound = self.twin(actor)
        bound.path = f"{actor.path}.{self.name}"
        return bound

    def twin(self, actor: Any) -> Any:
        """The same port of another instance with the same path."""
        bound = type(self).__new__(type(self))
        bound.terms, bound.path, bound.actor, bound.width = self.terms, self.path, actor, 0
        bound.begin(self)
        return bound

    def begin(self, like: Any) -> None:
        """Take the state that the port of an instance begins with."""

    def __repr__(self) -> str:
        return f"<{self.direction} port {self.path or self.name}: {type_name(self.type)}>"


class InputPort(Port[T]):
    """A port where tokens arrive: of any type if none is given.

    ``shape`` is that of a ``numpy`` array, as for parameters: ``(2,)`` a pair, ``(None, 2)`` rows of pairs.
    ``required``: a model is invalid if nothing is connected to it.  ``multi``: any number of connections, each a
    channel, in the order in which they are declared.  ``triggers``: a token makes the actor do its work; if false, the
    actor only stores it, which takes no time, and uses it later.
    """

    __slots__ = ("arrived", "channels", "shown")

    direction = "input"

    if TYPE_CHECKING:
        arrived: list[Any]  # since the last firing
        channels: list[int] | None  # of these tokens, if there are several connections
        shown: list[Any]  # the same as arrived, or empty while they are hidden

    required = _Term[bool]("required")
    triggers = _Term[bool]("triggers")

    def __init__(
        self,
        type: type[T] | types.UnionType = _ANY,
        *,
        shape: tuple[int | None, ...] | None = None,
        multi: bool = False,
        required: bool = True,
        triggers: bool = True,
        doc: str = "",
    ) -> None:
        Port.__init__(self, type, shape=shape, multi=multi, doc=doc)
        terms = self.terms
        terms.required, terms.triggers = required, triggers
        InputPort.begin(self, self)

    def begin(self, like: Any) -> None:
        self.arrived = self.shown = NO_TOKENS
        self.channels = None

    @property
    def present(self) -> bool:
        """Whether a token arrived at the present tag."""
        return bool(self.shown)

    @property
    def value(self) -> T:
        """The token of the present tag, the latest if there are several; raises ``PortError`` if there is none."""
        if not self.shown:
            raise PortError(f"{self.path} has no token at this tag; check 'present' before reading 'value'")
        token: T = self.shown[-1]
        return token

    @property
    def tokens(self) -> tuple[T, ...]:
        """All tokens of the present tag in the order of their arrival."""
        return tuple(self.shown)

    def by_channel(self) -> list[list[T]]:
        """The tokens of the present tag, a list for each channel."""
        if self.width == 1:
            return [list(self.tokens)]
        result: list[list[T]] = [[] for _ in range(self.width)]
        for token, channel in zip(self.shown, self.channels or (), strict=False):
            result[channel].append(token)
        return result

    def arrivals(self) -> list[tuple[int, T]]:
        """The tokens of the present tag, each with its channel, the lowest channel first."""
        if self.width == 1 or not self.shown:
            return [(0, token) for token in self.shown]
        return sorted(zip(self.channels or (), self.shown, strict=False), key=_FIRST)

    def receive(self, token: Any, channel: int) -> None:
        """Engine: a token arrives."""
        self.open()
        self.arrived.append(token)
        if self.width > 1:
            if self.channels is None:
                self.channels = []
            self.channels.append(channel)

    def open(self) -> None:
        """Engine: make room for tokens; most ports with a default never get any."""
        if self.arrived is NO_TOKENS:
            is_shown = self.shown is self.arrived
            self.arrived = []
            if is_shown:
                self.shown = self.arrived

    def clear(self) -> None:
        """Engine: forget the tokens that have come."""
        empty(self.arrived)
        if self.channels is not None:
            empty(self.channels)
        self.shown = self.arrived

    @property
    def has_new(self) -> bool:
        """Engine: whether a token has come since the last firing."""
        return bool(self.arrived)

    def take(self) -> tuple[list[Any], list[int]]:
        """Take out the tokens that have come since the last firing, and their channels if there are several."""
        taken = self.arrived, self.channels or []
        self.arrived = self.shown = []
        self.channels = None
        return taken

    def give(self, taken: tuple[list[Any], list[int]]) -> None:
        """Engine: show tokens that were taken out."""
        self.arrived = self.shown = list(taken[0])
        self.channels = list(taken[1]) or None


class OutputPort(Port[T]):
    """A port where tokens leave: of any type if none is given.

    ``depends_on`` names the inputs that a token may depend on within the same tag; ``None`` means all of them, ``()``
    none (an actor that delays), so that the port may be part of a loop.  ``independent_of`` names the others instead.
    """

    __slots__ = ("emitter",)

    direction = "output"

    depends_on = _Term["tuple[str, ...] | None"]("depends_on")

    def __init__(
        self,
        type: type[T] | types.UnionType = _ANY,
        *,
        shape: tuple[int | None, ...] | None = None,
        multi: bool = False,
        depends_on: tuple[str, ...] | None = None,
        independent_of: tuple[str, ...] = (),
        doc: str = "",
    ) -> None:
        Port.__init__(self, type, shape=shape, multi=multi, doc=doc)
        self.terms.depends_on, self.terms.independent_of = depends_on, independent_of
        self.emitter: Emitter | None = None

    def begin(self, like: Any) -> None:
        self.emitter = None

    def send(self, token: T, channel: int | None = None) -> None:
        """Send a token at the present tag: to all channels, or to the one given."""
        emitter = self.emitter
        if emitter is None:
            raise PortError(
                f"{self.path or self.name} cannot send now: send tokens only in fire() or run() of a running model"
            )
        if channel is None:
            emitter.put(token)
        else:
            emitter.to(channel).put(token)

    def connect(self, emit: Emitter | Callable[..., None]) -> None:
        """Engine: set what ``send`` does from now on; a function is called with token and channel."""
        self.emitter = emit if isinstance(emit, Emitter) else _Told(emit)

    def disconnect(self) -> None:
        """Engine: from now on nothing can be sent."""
        self.emitter = None
