"""What the actors here have in common: other declarations than those of Epicycle's, and tokens that wait."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from typing import Any

from epicycle.actors import Actor, InputPort, Parameter


def but(port: Any, **terms: object) -> Any:
    """A declared port, with other terms."""
    made = port.twin(None)
    for term, value in terms.items():
        made.change(term, value)
    return made


def preset(parameter: Any, default: object) -> Any:
    """A declared parameter, with another default."""
    made = Parameter.__new__(type(parameter))
    vars(made).update({key: value for key, value in vars(parameter).items() if key != "default_value"})
    made.default = default
    return made


class Waiting:
    """The tokens of some inputs, which wait until they are taken out: a queue for each channel."""

    def __init__(self, ports: Sequence[InputPort[Any]]) -> None:
        self.ports = ports
        self._lines = {port.name: [deque[Any]() for _ in range(port.width)] for port in ports}

    def come(self) -> int:
        """Let in what has arrived; returns how many tokens wait."""
        for port in self.ports:
            tokens, channels = port.take()
            for place, token in enumerate(tokens):
                self._lines[port.name][channels[place] if channels else 0].append(token)
        return sum(len(line) for lines in self._lines.values() for line in lines)

    def firings(self) -> Iterator[None]:
        """Once for a firing, and again as long as the last one has taken some tokens and left others."""
        before = self.come()
        yield
        while 0 < (left := self.come()) < before:
            before = left
            yield

    def has(self, port: InputPort[Any]) -> bool:
        """Whether a token waits on the first channel of an input."""
        lines = self._lines[port.name]
        return bool(lines and lines[0])

    @property
    def is_complete(self) -> bool:
        """Whether a token waits on each channel."""
        return all(line for lines in self._lines.values() for line in lines)

    def firsts(self, port: InputPort[Any]) -> tuple[list[Any], list[int]]:
        """Take out the first token of each channel that has one; returns them with their channels."""
        found = [(line.popleft(), channel) for channel, line in enumerate(self._lines[port.name]) if line]
        return [token for token, _ in found], [channel for _, channel in found]


class Singly(Actor):
    """An actor that takes one token of each channel per firing, and fires again at the same tag for the rest."""

    def initialize(self) -> None:
        super().initialize()
        self._waiting = Waiting(self.waited_for())

    def waited_for(self) -> list[InputPort[Any]]:
        """The inputs whose tokens it takes one by one."""
        return list(self.inputs.values())

    def fire(self) -> None:
        for _ in self._waiting.firings():
            for port in self._waiting.ports if self.is_ready() else ():
                port.give(self._waiting.firsts(port))
            self.fire_once()
            for port in self.inputs.values():
                port.clear()

    def is_ready(self) -> bool:
        """Whether it takes the tokens that wait."""
        return True

    def fire_once(self) -> None:
        """Fire with the tokens that it has taken."""
        super().fire()


class Together(Singly):
    """An actor that takes one token of each input per firing: none as long as one of them has none."""

    def is_ready(self) -> bool:
        return self._waiting.is_complete
