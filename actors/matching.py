"""Tokens that wait for each other, or are compared."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from .core import InputPort
from .expression import operand


def matched(ports: Sequence[InputPort[Any]]) -> Iterator[dict[str, Any]]:
    """The first token of each of several single ports that keep their tokens, by name, if there is one at each
    connected port.

    At most once: while there are more tokens, the actor fires again, as in Ptolemy.
    """
    connected = [port for port in ports if port.width]
    if all(port.present for port in connected):
        yield {port.name: port.get() for port in connected}


def taken(port: InputPort[Any]) -> int:
    """Take out the first token of each channel of a port that keeps tokens; returns how many there were."""
    found = [port.get(channel) for channel in range(port.width) if port.waiting(channel)]
    return len(found)


def alike(token: Any, other: Any, tolerance: float) -> bool:
    """Whether tokens are equal except that numbers may differ by a tolerance; lists and fields are compared item by
    item."""
    token, other = operand(token), operand(other)
    if isinstance(token, list) and isinstance(other, list):
        return len(token) == len(other) and all(map(alike, token, other, [tolerance] * len(token)))
    if isinstance(token, Mapping) and isinstance(other, Mapping):
        return token.keys() == other.keys() and all(alike(token[key], other[key], tolerance) for key in token)
    if isinstance(token, bool) or isinstance(other, bool):
        return token is other
    if isinstance(token, (int, float)) and isinstance(other, (int, float)):
        return token == other or abs(token - other) <= tolerance
    return bool(token == other)
