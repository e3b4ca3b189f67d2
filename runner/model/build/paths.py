"""What aspects and monitors select from and read, and how one of them sees it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from epicycle.actors import Fault, FaultError, declared_parameters, did_you_mean, paths
from epicycle.actors.expression import PortFormula
from epicycle.aspects import (
    Aspect,
    ByActorParameter,
    FiringTime,
    FiringTimeParameter,
    JoinPointAspect,
    PortsParameter,
    Reading,
    Selection,
    SelectionParameter,
)

from ..graph.model_graph import ModelGraph
from ..graph.woven import WovenAspect
from ..language.places import PointcutText
from ..text.document import Node
from ..text.faults import blame
from ..text.kinds import Kind
from ..text.patterns import PathIndex, PatternError
from ..text.problems import NONE, Near, Poison, Position, Problems
from ..text.reading import Text, within

PlaceOf = Callable[[Fault], Position]  # where a fault of an aspect's parameters is


class Paths:
    """What the pointcuts of a model's aspects select from, determined once for all of them; of ``ports``, or of all."""

    def __init__(self, graph: ModelGraph, ports: Iterable[str] | None = None) -> None:
        self.graph = graph
        self.ports = self._index(graph.ports if ports is None else ports)

    def _index(self, paths: Iterable[str]) -> PathIndex:
        return PathIndex(paths, self.graph.limits)

    @cached_property
    def actors(self) -> PathIndex:
        return self._index(self.graph.actors)

    @cached_property
    def holders(self) -> PathIndex:
        """All actors and composites."""
        return self._index([*self.graph.actors, *self.graph.composites])

    @cached_property
    def owners(self) -> PathIndex:
        """All composites and actors, including those that could not be made."""
        unmade = sorted(set(map(paths.parent, self.graph.fed)))
        return self._index(dict.fromkeys((*self.graph.composites, *self.graph.actors, *unmade)))


@dataclass
class View:
    """A model as one aspect or monitor sees it: names are relative to ``scope``, the composite that declares it."""

    paths: Paths
    name: str
    scope: str
    problems: Problems
    called: str = field(default="aspect", kw_only=True)

    @property
    def graph(self) -> ModelGraph:
        return self.paths.graph

    @property
    def ports(self) -> PathIndex:
        return self.paths.ports

    def _full(self, text: str) -> str:
        return paths.join(self.scope, text)

    def tell(
        self,
        message: str,
        where: PointcutText | Text | Position | None,
        *hints: str,
        about: tuple[str, ...] = (),
        kind: Kind | None = None,
        near: Near = NONE,
    ) -> Poison:
        """Report a problem of the aspect or monitor."""
        position = where.position if isinstance(where, (PointcutText, Text)) else where
        said = f"{self.called} {self.name}: {message}"
        return self.problems.add(said, position, *hints, scope=self.scope, about=about, kind=kind, near=near)

    def blame(self, error: FaultError, where: Node | Position) -> Poison:
        """Report what is wrong with a node, or with something at a position."""
        return blame(self.problems, f"{self.called} {self.name}", error, where, self.scope)

    def read_by(self, aspect: Aspect, ports: list[str], place_of: PlaceOf) -> dict[str, Any]:
        """What an aspect's expressions ask for, what its patterns select, and the other ports that it reads.

        ``ports`` are those that it attaches to; ``place_of`` returns where a parameter is set in the model file.
        """
        readings: dict[PortFormula, list[Reading]] = {}
        selections: dict[str, Selection] = {}
        reads: list[str] = []
        for name, parameter in declared_parameters(type(aspect)).items():
            value, position = getattr(aspect, name), place_of(Fault("", (name,)))
            if isinstance(parameter, SelectionParameter):
                patterns = parameter.patterns(value)
                found = selections[name] = {each: self._selected(name, each, parameter, position) for each in patterns}
                if isinstance(parameter, PortsParameter):
                    reads += [port for ports_found in found.values() for port in ports_found]
            elif isinstance(value, PortFormula):
                readings[value] = [self.reading(name, each, position) for each in value.references]
                for reference, fields in value.given_fields:
                    self._check_given(name, reference, fields, ports, position)
        asked = aspect.reads() if isinstance(aspect, JoinPointAspect) else ()
        chosen = (port for pattern in asked for port in self.ports.select(self._full(pattern)))
        reads += self.ports.in_order({port for port in chosen if self.graph.direction(port) == "output"})
        return {"readings": readings, "selections": selections, "reads": reads}

    def _selected(self, name: str, pattern: str, parameter: SelectionParameter[Any], position: Position) -> list[str]:
        """What a pattern in the parameter ``name`` selects."""
        of_ports = isinstance(parameter, PortsParameter)
        paths = self.ports if of_ports else self.paths.holders
        try:
            found = paths.select(self._full(pattern))
        except PatternError as error:
            self.tell(f"{name}: {pattern!r} is not a pattern: {error}", within(position, pattern))
            return []
        fitting = [path for path in found if not of_ports or self._sends(path)]
        position = within(position, pattern)
        if found and not fitting:
            self.tell(f"{name}: {found[0]} is an input port, but an output port is needed", position)
        elif not found and not self.graph.excuses(self._full(pattern) + ("" if of_ports else ".*")):
            near = paths.near(pattern, self.scope, lambda path: not of_ports or self._sends(path))
            self.tell(f"{name}: {pattern!r} matches no {parameter.selects}", position, near=near)
        elif len(fitting) > 1 and parameter.is_single:
            self.tell(f"{name}: {pattern!r} selects {fitting[0]} and {fitting[1]}, but must select one", position)
        return fitting

    def reading(self, name: str, reference: str, position: Position) -> Reading:
        """The port that a dotted name in the parameter ``name`` begins with, and the fields that follow."""
        position = within(position, reference)
        parts = self._full(reference).split(".")
        for length in range(len(parts), 1, -1):
            port = ".".join(parts[:length])
            if port in self.ports and self.graph.direction(port) == "output":
                fields = tuple(parts[length:])
                self._check_fields(name, reference, port, fields, position)
                return port, fields
        if self.graph.excuses(self._full(reference)):
            return reference, ()  # nothing can send there now, so the condition never holds
        if self._full(reference) in self.ports:
            self.tell(f"{name}: {reference} is an input port, but an output port is needed", position)
        else:
            near = self.ports.near(reference, self.scope, self._sends)
            self.tell(f"{name}: {reference!r} names no output port", position, near=near)
        return reference, ()

    def _check_given(
        self, name: str, reference: str, fields: tuple[str, ...], ports: list[str], position: Position
    ) -> None:
        """Check that the tokens that pass the aspect have the field; the first port that lacks it is reported."""
        for port in ports:
            at = within(position, reference)
            if not self._check_fields(name, f"{reference} at {port}", port, fields, at):
                return

    def _check_fields(self, name: str, reference: str, port: str, fields: tuple[str, ...], position: Position) -> bool:
        """Check that the tokens of a port have the field, if their type is known."""
        for source in self.graph.source_of(port) if fields else ():
            if isinstance(source.type, type) and dataclasses.is_dataclass(source.type):
                names = [each.name for each in dataclasses.fields(source.type)]
                if fields[0] not in names:
                    message = f"{name}: {reference}: {source.type.__name__} has no field {fields[0]!r}"
                    self.tell(message, position, f"its fields: {', '.join(names)}", near=(fields[0], names))
                    return False
        return True

    def _sends(self, port: str) -> bool:
        return self.graph.direction(port) == "output"


def unknown_inputs(woven: WovenAspect, graph: ModelGraph) -> Iterator[Fault]:
    """Ports that an aspect's parameters name but that no actor has to which they apply."""
    for name, parameter in declared_parameters(type(woven.aspect)).items():
        value = getattr(woven.aspect, name)
        if isinstance(parameter, FiringTimeParameter):
            yield from (each.within(name) for each in without_port(name, value, woven.actors, graph))
        elif isinstance(parameter, ByActorParameter) and isinstance(parameter.item, FiringTimeParameter):
            for pattern, each in value.items():
                chosen = {pattern: woven.selections[name].get(pattern, ())}
                actors = [path for path in woven.actors if ByActorParameter.of({pattern: True}, chosen, path)]
                faults = without_port(f"{name}: {pattern}", each, actors, graph)
                yield from (fault.within(name, pattern) for fault in faults)


def without_port(name: str, times: FiringTime, actors: Iterable[str], graph: ModelGraph) -> Iterator[Fault]:
    """The ports in execution times that none of these actors has."""
    inputs = dict.fromkeys(port for path in actors for port in graph.actors[path].inputs)
    for port in times if isinstance(times, Mapping) and inputs else ():
        if port not in inputs:
            near = did_you_mean(port, inputs)
            message = f"{name}: no actor that this applies to has an input {port!r}{near}"
            yield Fault(message, (port,), of_key=True, help=(f"their inputs: {', '.join(inputs)}",))
