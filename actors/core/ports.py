"""Ports: the typed ends of wires.  Declared on an actor's class, bound to each of its instances.

An input port holds the tokens of the present tag and nothing else: after the actor has fired they are gone.
An output port hands a token on at once; who gets it, and through which delays and aspects, is the engine's matter.
"""

from __future__ import annotations

import types
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Generic, Protocol

from .inbox import Inbox, PortError
from .port_types import shaped, type_name

if TYPE_CHECKING:
    from typing_extensions import TypeVar

    T = TypeVar("T", default=Any)
else:
    from typing import TypeVar

    T = TypeVar("T")

_ANY: Any = Any


class Emit(Protocol):
    """What ``send`` does in a running model."""

    def __call__(self, token: Any, channel: int | None = None) -> None:
        """Send a token to all channels, or to one."""


class _Port(Generic[T]):
    """What both directions share: the declaration, and where the instance stands."""

    direction = ""

    def __init__(self, type: Any, *, shape: tuple[int | None, ...] | None, multi: bool, doc: str) -> None:
        self.type = type if shape is None else shaped(type, shape)
        self.multi = multi
        self.doc = doc
        self.name = ""
        self.path = ""
        self.actor: Any = None

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def bind(self, actor: Any) -> Any:
        """The port of one instance."""
        bound = type(self).__new__(type(self))
        # One by one: an instance whose __dict__ was never asked for keeps its attributes in itself, where they take a
        # third of the space and are found sooner.
        for name, value in vars(self).items():
            setattr(bound, name, value)
        bound.actor = actor
        bound.path = f"{actor.path}.{self.name}"
        return bound

    def __repr__(self) -> str:
        return f"<{self.direction} port {self.path or self.name}: {type_name(self.type)}>"


class InputPort(_Port[T], Inbox):
    """Where tokens arrive: of any type if none is given.

    ``shape`` is that of a ``numpy`` array, as for parameters: ``(2,)`` a pair, ``(None, 2)`` rows of pairs.
    ``required``: the model is wrong when nothing is connected to it.  ``multi``: any number of connections, each a
    channel, in the order in which they are declared.  ``triggers``: a token makes the actor do its work; if not, the
    actor only takes note of it, which takes no time, and works with it later.
    """

    direction = "input"

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
        super().__init__(type, shape=shape, multi=multi, doc=doc)
        self.required = required
        self.triggers = triggers
        Inbox.__init__(self)

    def bind(self, actor: Any) -> InputPort[T]:
        bound: InputPort[T] = super().bind(actor)
        bound.width = 0
        bound.clear()
        return bound

    if TYPE_CHECKING:  # what an inbox of any tokens has, with the port's own type

        @property
        def value(self) -> T: ...
        @property
        def tokens(self) -> tuple[T, ...]: ...
        def by_channel(self) -> list[list[T]]: ...


class OutputPort(_Port[T]):
    """Where tokens leave: of any type if none is given.

    ``depends_on`` names the inputs that a token may depend on within the same tag; ``None`` means all of them, ``()``
    none (an actor that delays), which lets the port stand in a loop.
    """

    direction = "output"

    def __init__(
        self,
        type: type[T] | types.UnionType = _ANY,
        *,
        shape: tuple[int | None, ...] | None = None,
        multi: bool = False,
        depends_on: tuple[str, ...] | None = None,
        doc: str = "",
    ) -> None:
        super().__init__(type, shape=shape, multi=multi, doc=doc)
        self.depends_on = depends_on
        self.width = 0

    def send(self, token: T, channel: int | None = None) -> None:
        """Send a token at the present tag: to all channels, or to the one given."""
        raise PortError(
            f"{self.path or self.name} cannot send now: tokens are sent in fire() or run() of a running model"
        )

    def connect(self, emit: Emit) -> None:
        """Engine: what ``send`` does from now on."""
        self.send = emit  # type: ignore[method-assign]  # a call less for each token

    def disconnect(self) -> None:
        """Engine: from now on nothing can be sent."""
        with suppress(AttributeError):
            del self.send
