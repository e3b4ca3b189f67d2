"""How a test of an aspect runs a model, and what it gets from there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from epicycle.aspects import Aspect


@dataclass(frozen=True)
class Woven:
    """An aspect, its name, and the pointcuts where it is to stand."""

    name: str
    aspect: Aspect
    at: str | Sequence[str] = "**"


class Event(Protocol):
    """A record of the event log, as ``Record`` of ``epicycle.runner`` is one."""

    @property
    def actor(self) -> str:
        """The actor or composite at whose port it took place."""

    @property
    def port(self) -> str:
        """The name of the port."""

    @property
    def aspect(self) -> str:
        """The name of the aspect that acted, empty for a send."""

    def encoded(self, *, microstep: bool = True) -> bytes:
        """All of it, to the bit; with ``microstep`` false but for that."""


class RunModel(Protocol):
    """Runs a model with some aspects woven in addition to its own, and returns the records of the event log."""

    def __call__(self, *woven: Woven) -> Sequence[Event]: ...
