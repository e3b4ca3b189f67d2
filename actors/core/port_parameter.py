"""PortParameter: a parameter whose value may also come over a port of the same name (Ptolemy's ``PortParameter``)."""

from __future__ import annotations

import types
from typing import Any, TypeVar, overload

from .parameter import Parameter, ParameterError
from .ports import InputPort

T = TypeVar("T")
NOTHING_YET: Any = object()


class ParameterPort(InputPort[T]):
    """The port of a ``PortParameter``: remembers the latest token beyond its tag."""

    copies_share = ("_parameter",)  # the declaration is the class's

    def __init__(self, parameter: PortParameter[T], type: Any, doc: str) -> None:
        super().__init__(type, required=False, doc=doc)
        self._parameter = parameter
        self._received: Any = NOTHING_YET
        self._current: Any = NOTHING_YET
        self.has_received = False  # which is asked first: most have not, and are read for every token
        self._before: Any = NOTHING_YET  # what had been received, and not been read, before the present tag

    def receive(self, token: T, channel: int) -> None:
        if not self.arrived:
            self._before = self._received
        InputPort.receive(self, token, channel)  # past super(), as this is done for each token
        self._received = token
        self.has_received = True

    def take(self) -> tuple[list[T], list[int]]:
        self._received = self._before
        return super().take()

    def give(self, taken: tuple[list[T], list[int]]) -> None:
        super().give(taken)
        self._received = taken[0][-1]
        self.has_received = True

    def reset(self) -> None:
        """Forget what came: the declared value counts again."""
        self._received = self._current = NOTHING_YET
        self.has_received = False

    def current(self, initial: T) -> T:
        """The value at present: the latest token that came, or else the value given in the model."""
        if self._received is not NOTHING_YET:
            # Converted when it is read, so that a bad token is the receiver's error and not the sender's.
            token, self._received = self._received, NOTHING_YET
            try:
                self._current = self._parameter.convert(token)
            except ParameterError as error:
                raise ParameterError(f"{self.path}: {error}") from None
        result: T = initial if self._current is NOTHING_YET else self._current
        return result


class PortParameter(Parameter[T]):
    """A parameter with an input port of the same name: a token that arrives there is its value from then on.

    ``delay: 2 s`` in a model gives the first value, ``source.output -> actor.delay`` changes it.  On an instance it
    reads as its value; the port is ``actor.inputs["delay"]`` and need not be connected.
    """

    def __init__(self, type: type[T] | types.UnionType, *arguments: Any, **keywords: Any) -> None:
        super().__init__(type, *arguments, **keywords)
        self.port: ParameterPort[T] = ParameterPort(self, type, self.doc)

    def __set_name__(self, owner: type, name: str) -> None:
        super().__set_name__(owner, name)
        self.port.__set_name__(owner, name)

    @overload
    def __get__(self, instance: None, owner: type) -> PortParameter[T]: ...
    @overload
    def __get__(self, instance: object, owner: type) -> T: ...
    def __get__(self, instance: Any, owner: type) -> PortParameter[T] | T:
        if instance is None:
            return self
        port: ParameterPort[T] = instance.inputs[self.name]
        initial: T = instance.__dict__[self.name]
        return port.current(initial) if port.has_received else initial

    def store(self, instance: object, value: T | None) -> None:
        instance.__dict__[self.name] = value  # past __set__

    def __set__(self, instance: Any, value: T) -> None:
        # That it exists makes Python ask __get__ before the instance's __dict__, where the value given first lies.
        raise AttributeError(f"{instance.path}.{self.name} changes by a token at its port alone")
