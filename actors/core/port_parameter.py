"""PortParameter: a parameter whose value may also come over a port of the same name (Ptolemy's ``PortParameter``)."""

from __future__ import annotations

from types import UnionType
from typing import TYPE_CHECKING, Any, TypeVar, Unpack, overload

from .errors import ParameterError
from .parameter import REQUIRED, Parameter
from .ports import InputPort

if TYPE_CHECKING:
    from .parameter import Options

T = TypeVar("T")
V = TypeVar("V")
_NOTHING: Any = object()


class ParameterPort(InputPort[T]):
    """The port of a ``PortParameter``, which holds its value: it keeps the latest token beyond its tag."""

    __slots__ = ("_before", "_current", "_parameter", "_received", "given", "has_received")

    copies_share = (*InputPort.copies_share, "_parameter")  # the declaration is the class's

    def __init__(self, parameter: PortParameter[T], type: Any, doc: str) -> None:
        InputPort.__init__(self, type, required=False, doc=doc)
        self._parameter = parameter
        self.has_received = False
        self.start_with(_NOTHING)

    def begin(self, like: Any) -> None:
        InputPort.begin(self, like)
        self._parameter, self.has_received = like._parameter, False
        self.start_with(like.given)

    def start_with(self, value: T | None) -> None:
        """Take the value given in the model, which is used until a token comes."""
        self.given: Any = value
        if not self.has_received:
            self.reset()

    def reset(self) -> None:
        """Forget all tokens: the given value is used again."""
        self._current = self.given
        self._received = self._before = _NOTHING  # before: the tokens not yet read when the present tag began
        self.has_received = False

    def receive(self, token: Any, channel: int) -> None:
        if not self.arrived:
            self._before = self._received
        InputPort.receive(self, token, channel)
        self._received = token
        self.has_received = True

    def take(self) -> tuple[list[Any], list[int]]:
        self._received = self._before
        return InputPort.take(self)

    def give(self, taken: tuple[list[Any], list[int]]) -> None:
        InputPort.give(self, taken)
        self._received = taken[0][-1]
        self.has_received = True

    def settle(self, value: T | None) -> None:
        """Set the value, made from what was received."""
        self._current = value
        self._received = _NOTHING

    def current(self) -> T:
        """The present value: the latest token, or else the value given in the model."""
        if self._received is not _NOTHING:
            # Converted on reading, so that a bad token is the receiver's error and not the sender's.
            token, self._received = self._received, _NOTHING
            try:
                self.settle(self._parameter.convert(token))
            except ParameterError as error:
                raise ParameterError(f"{self.path}: {error}") from None
        result: T = self._current
        return result


class PortParameter(Parameter[T]):
    """A parameter with an input port of the same name: a token that arrives there is its value from then on.

    ``delay: 2 s`` in a model gives the first value, ``source.output -> actor.delay`` changes it.  On an instance it
    reads as its value; the port is ``actor.inputs["delay"]`` and need not be connected.
    """

    @overload
    def __init__(self: PortParameter[V | None], type: type[V], default: None, **options: Unpack[Options]) -> None: ...
    @overload
    def __init__(self: PortParameter[V], type: type[V], default: V = ..., **options: Unpack[Options]) -> None: ...
    @overload
    def __init__(
        self: PortParameter[float], type: UnionType, default: float = ..., **options: Unpack[Options]
    ) -> None: ...
    def __init__(self, type: Any, default: Any = REQUIRED, **options: Any) -> None:
        Parameter.__init__(self, type, default, **options)
        self.port: ParameterPort[T] = ParameterPort(self, type, self.doc)
        self.port_name = ""

    def __set_name__(self, owner: type, name: str) -> None:
        Parameter.__set_name__(self, owner, name)
        self.port.__set_name__(owner, name)
        self.port_name = name

    @overload
    def __get__(self, instance: None, owner: type) -> PortParameter[T]: ...
    @overload
    def __get__(self, instance: object, owner: type) -> T: ...
    def __get__(self, instance: Any, owner: type) -> PortParameter[T] | T:
        if instance is None:
            return self
        port: ParameterPort[T] = instance.inputs[self.port_name]  # as in port_of and current, without the calls
        result: T = port._current if port._received is _NOTHING else port.current()
        return result

    def __set__(self, instance: Any, value: T) -> None:
        raise AttributeError(f"{instance.path}.{self.name} can only be changed by a token at its port")

    def store(self, instance: Any, value: T | None) -> None:
        self.port_of(instance).start_with(value)

    def value_in(self, instance: Any) -> T | None:
        value: T | None = self.port_of(instance).given
        return value

    def port_of(self, instance: Any) -> ParameterPort[T]:
        """The port of one instance."""
        port: ParameterPort[T] = instance.inputs[self.port_name]
        return port
