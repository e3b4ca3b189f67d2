"""What a program names when it builds a model, as objects or text, converted to what a file would declare."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

from epicycle.actors import Actor, InputPort, OutputPort, ParameterError, paths
from epicycle.aspects import Aspect, FiringTime, FiringTimeParameter

from ..graph.model_graph import ModelGraph
from ..language.fields import Computed, nanoseconds, sound
from ..language.models import DIRECTOR
from ..language.places import ConnectionText, Endpoint, PointcutText, connection, endpoint
from ..language.values import Locals, Values
from ..text.document import Scalar
from ..text.faults import blame
from ..text.problems import POISON, ModelError, Poison, Position, Problem, Problems
from ..text.program import node_of
from ..text.reading import NodeReader, Text, within


@dataclass(frozen=True)
class CompositePort:
    """A port of a composite, through which tokens pass."""

    path: str
    direction: str

    def __repr__(self) -> str:
        return f"<{self.direction} port {self.path} of a composite>"


Port: TypeAlias = "InputPort[Any] | OutputPort[Any] | CompositePort"
Ends: TypeAlias = "str | Port | Iterable[str | Port]"
Place: TypeAlias = "str | Port | Actor | Holder"
Places: TypeAlias = "Place | Iterable[Place]"


class Holder:
    """A composite: it has parts."""

    path: str


@contextmanager
def raising() -> Iterator[Problems]:
    """Collects problems and raises them at the end, if there are any."""
    problems = Problems()
    yield problems
    problems.raise_if_any()


def director_of(path: str, said: Mapping[str, object], position: Position, problems: Problems) -> dict[str, Any]:
    """The rules given for a director, ``None`` for those not given; wrong ones are reported and left out."""
    values, given = (
        Values(problems),
        {key: node_of(value, position) for key, value in said.items() if value is not None},
    )
    rules = {key: DIRECTOR.keys[key].shape.read(None, node, key) for key, node in given.items()}
    return sound({key: values.value(each, Locals(), f"{path}: director.{key}") for key, each in rules.items()})


def check_aspect(aspect: object, kinds: tuple[type, ...], position: Position, problems: Problems) -> None:
    """Check that what is to be woven is an object of one of the kinds."""
    if isinstance(aspect, type) or not isinstance(aspect, kinds):
        shown = aspect.__name__ if isinstance(aspect, type) else repr(aspect)
        problems.add(f"{shown} is not an aspect", position, "give an object, such as PacketLoss(probability=0.1)")


def firing_time_of(time: object, aspect: object, position: Position, problems: Problems) -> FiringTime | None:
    """How long firings take; None if the aspect does not attach to actors, or not as a model."""
    if time is not None and isinstance(aspect, Aspect):
        problems.add(f"{type(aspect).__name__} is not a composite, so weave() takes no 'time' for it", position)
    try:
        return None if time is None else FiringTimeParameter().convert(time)
    except ParameterError as error:
        blame(problems, "time", error, position)
        return None


def each_of(ends: object) -> list[Any]:
    """One or several ends as a list, which are checked later."""
    return list(ends) if isinstance(ends, Iterable) and not isinstance(ends, str) else [ends]


def mistake(message: str, position: Position, *hints: str) -> ModelError:
    return ModelError([Problem(message, position, hints)])


class Named:
    """Finds in a graph what a program names inside a scope; problems are reported at the program's line."""

    def __init__(self, graph: ModelGraph, scope: str, position: Position, problems: Problems) -> None:
        self._graph = graph
        self._scope = scope
        self._position = position
        self._problems = problems

    def connection(
        self, source: Ends, destination: Ends | None, delay: float | str | None, inside: str
    ) -> ConnectionText | None:
        """A connection as a model file would declare it; ``inside`` is the name of the scope."""
        made: ConnectionText | Poison = POISON
        if destination is not None:
            sources, destinations = self._ends(source, inside), self._ends(destination, inside)
            if sources is not POISON and destinations is not POISON:
                made = ConnectionText(self._position, sources, destinations)
        elif isinstance(source, str):
            made = connection(NodeReader(self._problems), Scalar(source, source, False, self._position))
        else:
            self._tell("the connection has no destination", "write connect(a.output, b.input)")
            return None
        # An empty list connects nothing: there may be no robots.
        if not made or not (made.sources and made.destinations):
            return None
        return made if delay is None else replace(made, delay=Computed(node_of(delay, self._position), nanoseconds))

    def pointcuts(self, at: Places | Mapping[str, Places], cls: type[Aspect]) -> list[PointcutText]:
        """Pointcuts as a model file would declare them."""
        found = []
        for request, ends in at.items() if isinstance(at, Mapping) else ((None, at),):
            asked = None if request is None else Text(request, self._position)
            for end in each_of(ends):
                if isinstance(end, str):
                    found.append(replace(PointcutText.of(self._text(end)), request=asked))
                elif (path := self._place(end, cls)) is not None:
                    here = paths.relative(path, self._scope)
                    found.append(PointcutText(here, within(self._position, here), request=asked))
        return found

    def watched(self, port: object) -> Text | None:
        """A port, or a pattern of ports, as a model file would name what is watched."""
        path = port if isinstance(port, str) else self._port(port)
        return None if path is None else self._text(path)

    def _text(self, name: str) -> Text:
        return Text(name, within(self._position, name))

    def _tell(self, message: str, *hints: str) -> None:
        self._problems.add(message, self._position, *hints)

    def _ends(self, ends: Ends, inside: str) -> tuple[Endpoint, ...] | Poison:
        reader = NodeReader(self._problems)
        found = [
            endpoint(reader, self._text(end)) if isinstance(end, str) else self._seen_from_inside(end, inside)
            for end in each_of(ends)
        ]
        return POISON if POISON in found else tuple(end for end in found if end)

    def _seen_from_inside(self, port: object, inside: str) -> Endpoint | Poison:
        """A port as one end of a connection inside the scope."""
        path = self._port(port)
        if path is None:
            return POISON
        owner, _, name = path.rpartition(".")
        scope, _, actor = owner.rpartition(".")
        if self._scope in (owner, scope):
            actor, bracket, index = ("" if owner == self._scope else actor).partition("[")
            text = paths.relative(path, self._scope)
            return Endpoint(text, within(self._position, text), actor, index[:-1] if bracket else None, name)
        there = f"in {scope}" if scope else "at the top of the model"
        hint = f"connect it {there}, where {owner} is; ports of composites lead in and out"
        self._tell(f"{path} cannot be connected in {inside}", hint)
        return POISON

    def _place(self, place: object, cls: type[Aspect]) -> str | None:
        """The path of a port, or of an actor or composite if the aspect attaches to these."""
        if cls.at_ports or not isinstance(place, (Actor, Holder)):
            return self._port(place)
        if isinstance(place, Actor) and self._graph.actors.get(place.path) is not place:
            self._tell(f"{place.path} is not part of this model", "add it to the model first")
            return None
        return place.path

    def _port(self, port: Any) -> str | None:
        """The path of a port of the graph."""
        graph = self._graph
        if isinstance(port, (Actor, Holder)):
            kind = "an actor" if isinstance(port, Actor) else "a composite"
            ports = [each for each in graph.ports if paths.parent(each) == port.path]
            self._tell(f"{port.path} is {kind}, not a port", f"name one of its ports: {', '.join(ports) or 'none'}")
            return None
        if not isinstance(port, (InputPort, OutputPort, CompositePort)):
            self._tell(f"{port!r} is not a port", "give a port such as clock.output, or its path as text")
            return None
        path: str = port.path
        if not path:
            self._tell(f"{port!r} is declared in a class", "give the port of an actor that was added to the model")
        elif path not in graph.ports or graph.ports[path].port not in (port, None):
            self._tell(f"the actor of {path} is not part of this model", "add it to the model first")
        else:
            return path
        return None
