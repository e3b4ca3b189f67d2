"""What a program names when it builds a model: ports and lists of them; and how its mistakes are told."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, runtime_checkable

from epicycle.actors import Actor, InputPort, OutputPort, ParameterError
from epicycle.aspects import Aspect, FiringTime, FiringTimeParameter

from ..graph import WovenAspect
from ..text import ModelError, Position, Problem, Problems
from .draft import Draft
from .settle import drift, local_nanoseconds

if TYPE_CHECKING:
    from .scope import Composite


@dataclass(frozen=True)
class CompositePort:
    """A port of a composite, through which tokens pass."""

    path: str
    direction: str

    def __repr__(self) -> str:
        return f"<{self.direction} port {self.path} of a composite>"


Port: TypeAlias = "InputPort[Any] | OutputPort[Any] | CompositePort"
Ends: TypeAlias = "str | Port | Iterable[str | Port]"
Place: TypeAlias = "str | Port | Actor | Composite"
Places: TypeAlias = "Place | Iterable[Place]"


@runtime_checkable
class Instance(Protocol):
    """An instance of a composite class that can be added to a model; see ``load_composite``."""

    path: str

    def unfold(self, path: str, draft: Draft, position: Position) -> tuple[Draft, list[WovenAspect]]:
        """What it is as a part of a draft, at its full path, with the aspects that come with it."""


@contextmanager
def raising() -> Iterator[Problems]:
    """Collects problems and raises them at the end, if there are any."""
    problems = Problems()
    yield problems
    problems.raise_if_any()


def clock_of(
    path: str, start: object, speed: object, position: Position, problems: Problems
) -> tuple[int | None, float]:
    """When the local time of a composite starts (ns; None: as it is around it) and how fast it goes."""
    found: list[Any] = [None, 1.0]
    for number, (key, value, convert) in enumerate((("start", start, local_nanoseconds), ("drift", speed, drift))):
        try:
            found[number] = found[number] if value is None else convert(value)
        except (ParameterError, ValueError) as error:
            problems.add(f"{path}: director.{key}: {error}", position)
    return found[0], found[1]


def check_aspect(aspect: object, kinds: tuple[type, ...], position: Position, problems: Problems) -> None:
    """See that what is to be woven is an object of one of the kinds."""
    if isinstance(aspect, type) or not isinstance(aspect, kinds):
        shown = aspect.__name__ if isinstance(aspect, type) else repr(aspect)
        problems.add(f"{shown} is no aspect", position, "give an object, such as PacketLoss(probability=0.1)")


def firing_time_of(time: object, aspect: object, position: Position, problems: Problems) -> FiringTime | None:
    """How long firings take; None: the aspect does not stand at actors, or not as a model."""
    if time is not None and isinstance(aspect, Aspect):
        problems.add(f"{type(aspect).__name__} is no composite, so 'time' is not for weave() to say", position)
    try:
        return None if time is None else FiringTimeParameter().convert(time)
    except ParameterError as error:
        problems.add(f"time: {error}", position)
        return None


def each_of(ends: Ends | Places) -> list[Any]:
    """One or several ends as a list; what is no end is found out later."""
    return list(ends) if isinstance(ends, Iterable) and not isinstance(ends, str) else [ends]


def mistake(message: str, position: Position, *hints: str) -> ModelError:
    return ModelError([Problem(message, position, hints)])
