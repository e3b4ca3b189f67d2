"""What the actors here have in common: other declarations than those of Epicycle's, and tokens that wait."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from typing import Any

from epicycle.actors import InputPort, Parameter


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
    """The tokens of some inputs, which wait until they are taken out: a queue for each channel.

    In Ptolemy, an actor takes one token of each channel per firing, and fires again at the same tag for the rest.
    """

    def __init__(self, ports: Sequence[InputPort[Any]]) -> None:
        self._ports = ports
        self._lines = {port.name: [deque[Any]() for _ in range(port.width)] for port in ports}

    def come(self) -> int:
        """Let in what has arrived; returns how many tokens wait."""
        for port in self._ports:
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

    def has(self, port: InputPort[Any], channel: int = 0) -> bool:
        """Whether a token waits on a channel."""
        lines = self._lines[port.name]
        return channel < len(lines) and bool(lines[channel])

    def get(self, port: InputPort[Any], channel: int = 0) -> Any:
        """Take out the first token of a channel."""
        return self._lines[port.name][channel].popleft()

    def firsts(self, port: InputPort[Any]) -> list[Any]:
        """Take out the first token of each channel that has one."""
        return [line.popleft() for line in self._lines[port.name] if line]

    def together(self) -> dict[str, Any] | None:
        """Take out the first tokens of all connected inputs, each with one channel, if all have one."""
        lines = {name: each[0] for name, each in self._lines.items() if each}
        return {name: line.popleft() for name, line in lines.items()} if lines and all(lines.values()) else None
