"""Woven aspects: what attaches where in a model."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Self

from epicycle.actors import counted, paths
from epicycle.actors.expression import PortFormula
from epicycle.aspects import Aspect, ExecutionAspect, FiringTime, Reading, Selection

from ..text.problems import Position, Problems
from .acts import connection_place


@dataclass(frozen=True)
class AspectModel:
    """The composite of an aspect, the port from which it answers, and the port by which each place asks it."""

    path: str
    kind: str
    response: str
    requests: dict[str, str]
    times: dict[str, FiringTime] = field(default_factory=dict)  # how long the firings of an actor take

    def at(self, place: str) -> dict[str, object]:
        """What a model file would declare for a place: the request port, if there are several, and the time."""
        said: dict[str, object] = {}
        if len(set(self.requests.values())) > 1:
            said["request"] = paths.name(self.requests[place])
        if place in self.times:
            said["time"] = self.times[place]
        return said


@dataclass(frozen=True, eq=False, kw_only=True)
class Places:
    """Where an aspect attaches: ports, in the graph's order, single connections, actors, and parameters of actors.

    ``actors`` are with what the pointcut named: the actor, or a composite around it.
    """

    ports: list[str] = field(default_factory=list)
    connections: list[tuple[str, str]] = field(default_factory=list)
    actors: dict[str, str] = field(default_factory=dict)
    parameters: list[str] = field(default_factory=list)

    @property
    def places(self) -> list[str]:
        """All of them in words."""
        connections = (connection_place(*ends) for ends in self.connections)
        return [*self.ports, *connections, *self.actors, *self.parameters]

    def without(self, path: str) -> Self:
        """Those of them that are not in a part of the model."""
        return replace(
            self,
            ports=[port for port in self.ports if not paths.is_within(port, path)],
            actors={actor: unit for actor, unit in self.actors.items() if not paths.is_within(actor, path)},
            parameters=[each for each in self.parameters if not paths.is_within(each, path)],
            connections=[ends for ends in self.connections if not any(paths.is_within(end, path) for end in ends)],
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class WovenAspect(Places):
    """An aspect of a model at its places.

    ``model`` is its composite if it is a model itself, ``comes_with_actor`` means that the actor's class or instance
    was decorated.  ``readings`` are what its expressions over ports ask for, ``selections`` what its parameters with
    patterns select, ``reads`` the other ports that it reads.
    """

    name: str
    aspect: Aspect
    readings: dict[PortFormula, list[Reading]] = field(default_factory=dict)
    selections: dict[str, Selection] = field(default_factory=dict)
    reads: list[str] = field(default_factory=list)
    model: AspectModel | None = None
    comes_with_actor: bool = False
    position: Position | None = None

    @property
    def kind(self) -> str:
        """The name of its type."""
        return type(self.aspect).__name__ if self.model is None else self.model.kind

    @property
    def looks_at(self) -> list[str]:
        """All ports whose latest tokens it needs."""
        return [*self.reads, *(port for readings in self.readings.values() for port, _ in readings)]


def extent(aspects: Iterable[WovenAspect]) -> str:
    """The number of ports and actors that some aspects attach to, in words."""
    kinds = [
        "parameter" if place in woven.parameters else "actor" if place in woven.actors else "port"
        for woven in aspects
        for place in woven.places
    ]
    numbers = [(kinds.count(word), word) for word in ("port", "actor", "parameter")]
    said = [counted(number, noun) for number, noun in numbers if number]
    return " and ".join(said) or "no place"


def check_processors(aspects: Iterable[WovenAspect], problems: Problems) -> None:
    """Check that an actor runs on at most one processor."""
    taken: dict[str, str] = {}
    for woven in aspects:
        aspect = woven.aspect
        if not (isinstance(aspect, ExecutionAspect) and aspect.is_processor):
            continue
        if twice := [actor for actor in woven.actors if actor in taken]:
            message = f"aspect {woven.name}: {twice[0]} already runs on the processor {taken[twice[0]]!r}"
            hint = f"an actor has one processor: exclude it here, with '!{twice[0]}', or there"
            problems.add(message, woven.position, hint)
        taken.update(dict.fromkeys(woven.actors, woven.name))
