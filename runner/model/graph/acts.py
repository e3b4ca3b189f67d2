"""Acts: what aspects do to single tokens and firings, by names that are the same in every run of a model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple


class ActName(NamedTuple):
    """What an aspect does to the n-th token, or firing, that passes it at a place; the first is number 1."""

    aspect: str
    place: str  # a port, a connection 'a.out -> b.in', an actor or a parameter
    token: int

    def __str__(self) -> str:
        return f"{self.aspect} at {self.place}, token {self.token}"


def connection_place(source: str, destination: str) -> str:
    """The name of a single connection as the place of an act."""
    return f"{source} -> {destination}"


@dataclass(frozen=True)
class Act:
    """An act as it happened: the port that the token comes from, the time (ns), and its entry in the event log.

    ``token`` is a digest of what the aspect met, by which acts of one name in two runs are told apart.
    """

    name: ActName
    source: str
    time: int
    token: str
    events: tuple[str, ...]
