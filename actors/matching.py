"""Tokens that wait for each other, or are compared."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from .core import InputPort
from .expression import operand


def matched(ports: Sequence[InputPort[Any]]) -> Iterator[dict[str, Any]]:
    """Of single ports that keep their tokens, the first of each, by its name, once there is one at each connected port.

    Once at most: as long as there are more the actor fires again, as in Ptolemy.
    """
    connected = [port for port in ports if port.width]
    if all(port.present for port in connected):
        yield {port.name: port.get() for port in connected}


def taken(port: InputPort[Any]) -> int:
    """Take the first token of each channel out of a port that keeps them; how many there were."""
    found = [port.get(channel) for channel in range(port.width) if port.waiting(channel)]
    return len(found)


def alike(token: Any, other: Any, tolerance: float) -> bool:
    """Whether tokens are equal but for numbers that may differ so much; lists and fields are compared item by item."""
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
