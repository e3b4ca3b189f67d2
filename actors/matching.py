"""Tokens that wait for each other."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from .core import InputPort


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
