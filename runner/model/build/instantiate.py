"""The Instantiator: from declarations to a graph with all actors, composites and ports, connected.

Problems are reported and worked around, so that one load reports all of them: a wrong value becomes poison, and
what is computed from it is not checked; a part that cannot be made is a gap in the graph.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

from epicycle.actors import Actor, FaultError, Parameter, nearest, paths

from ..catalogue.dialect import Dialect
from ..catalogue.port_types import read_type, token_types
from ..catalogue.reference import about
from ..catalogue.types import Catalogue, CatalogueError, built_in
from ..graph.model_graph import ModelGraph
from ..graph.nodes import Gap
from ..language.fields import Computed, sound
from ..language.models import CompositeText
from ..language.parts import PartText
from ..language.ports import PortText
from ..language.values import Locals
from ..text.kinds import CLASS, CONNECTION, DIRECTOR, MODE, NAME, SIZE, TAKEN, UNKNOWN_TYPE
from ..text.limits import RAISE_IT
from ..text.problems import POISON, Poison, Position
from .composite_aspect import as_actor
from .connect import Member, Wiring, make, member_of_actors
from .modes import connect_modes
from .resolve import ParameterResolver

MAX_DEPTH = 50
MAX_SHOWN = 12  # types in one message
OF_YOUR_OWN = "for your own types, add '--types FILE.py'; in Python, pass the classes as types=[...]"

Names = dict[str, object]


class TooLargeError(Exception):
    """The model has too many parts to continue; the reason has been noted."""


@dataclass(frozen=True)
class PartTypes:
    """The possible types of parts: the composite classes of a model, and the installed types."""

    composites: Mapping[str, CompositeText | Poison]  # poison if the base is missing
    catalogue: Catalogue

    def like(self, dialect: type[Dialect]) -> PartTypes:
        """The possible types under a dialect."""
        return replace(self, catalogue=self.catalogue.like(dialect))

    def valid_types(self, kind: str, asked: str) -> tuple[str, ...]:
        """The valid types: their names, or how to list them if there are too many, and how to add more."""
        is_actor = kind == "actor"
        types: Collection[str] = self.catalogue.actors if is_actor else self.catalogue.aspects
        others: Collection[str] = self.catalogue.aspects if is_actor else self.catalogue.actors
        if asked in others:
            other = "aspect" if is_actor else "actor"
            return (f"{asked} is an {other}: it belongs under '{other}s'",)
        if asked.lower() == "composite":
            return ("a composite is declared under 'composites:', and its name is the type",)
        composites = sorted(self.composites) if is_actor else []
        if len(composites) + len(types) <= MAX_SHOWN:
            valid = ", ".join(sorted([*composites, *types]))
        else:
            own = ", ".join(composites[:MAX_SHOWN]) + (", ..." if len(composites) > MAX_SHOWN else "")
            valid = f"{f'{own}, and ' if own else ''}those that 'epicycle list {kind}s' lists"
        is_typo = nearest(asked, [*composites, *types], 0.8) is not None
        told = [] if is_typo else about(asked, built_in().actors if is_actor else built_in().aspects)[:MAX_SHOWN]
        hint = (f"types about {asked.lower()!r}: {', '.join(told)}",) if told else ()
        return f"valid types: {valid}", *hint, OF_YOUR_OWN


class Instantiator:
    """What is made from declarations: parts in a graph, and the aspects that are to be woven around them.

    ``trial``: parts are made only to find problems in them, up to that number; exceeding it is not reported.
    """

    def __init__(
        self, known: PartTypes, resolver: ParameterResolver, graph: ModelGraph, trial: int | None = None
    ) -> None:
        self.known = known
        self.resolver = resolver
        self.problems = resolver.problems
        self.graph = graph
        self.aspects: list[tuple[str, PartText, Names]] = []  # where they are declared, and what their values may use
        self.actors: list[Actor] = []
        self.classes: set[str] = set()  # the composites of which there are instances
        self.cost = 0  # actors and composites
        self.places = 0  # that aspects attach to
        self._trial = trial
        self._port_types: dict[str, Any] = {}
        self._tokens = cache(partial(token_types, known.catalogue))
        self._like = {Dialect: known}
        self._tried: set[tuple[str, str]] = set()  # classes, and the parts in them whose other types are checked

    def body(self, path: str, composite: CompositeText, names: Names, within: tuple[str, ...] = ()) -> None:
        """Make the actors of a composite, or of the model, and connect them; its aspects are noted."""
        members: dict[str, Member] = {}
        for name, part in composite.actors.items():
            full = paths.join(path, name)
            member = self.instances(full, part, names, within)
            if member is None:
                self.graph.gaps[full] = Gap()
            else:
                members[name] = member
        others = [
            (name, member)
            for name, part in composite.actors.items()
            for member in self._others(paths.join(path, name), composite, part, names, within)
        ]
        for name, part in composite.aspects.items():
            if part.type.text in self.known.composites and (
                model := self._aspect_model(path, composite, part, names, within)
            ):
                members[name] = model
        ports = composite.inputs, composite.outputs
        wiring = Wiring(self.graph, self.resolver, path, composite.name, *ports, composite.actors, members, composite)
        for name, member in others:
            wiring.check_ports(name, member, composite.connections)
        with self.problems.looking_for(CONNECTION):
            for connection in composite.connections:
                make(wiring.resolve(connection, names) if connection else [POISON], self.graph)
        if composite.machine is not None:
            with self.problems.looking_for(MODE):
                self._modes(path, composite, names, within)
        self.aspects += ((path, part, names) for part in composite.aspects.values())

    def _modes(self, path: str, composite: CompositeText, names: Names, within: tuple[str, ...]) -> None:
        """Make the machine of a composite with modes and their refinements, and connect them."""
        graph, made = self.graph, dict[str, str]()
        assert composite.machine is not None
        machine = f"{path}.{composite.machine.name}"
        self.instances(machine, composite.machine, names, within)
        for mode, part in composite.refinements.items():
            full = f"{path}.{mode}"
            kind = self._type(full, part, within)
            if isinstance(kind, CompositeText):
                self.instances(full, part, names, within, is_refinement=True)
                made[mode] = full
            elif kind is not None:
                message = f"{full}: {part.type.text} is an actor, but a refinement must be a composite"
                hint = "write a composite class that contains that actor"
                self.problems.add(message, part.type.position, hint, scope=path, kind=MODE)
        if made:
            graph.domains[path].machine, graph.domains[path].refinements = machine, made
        connect_modes(path, composite, self.known.composites, self.graph, self.problems)

    def instances(
        self, path: str, part: PartText, names: Names, within: tuple[str, ...] = (), *, is_refinement: bool = False
    ) -> Member | None:
        """Make the instances of one entry of ``actors``; None if there is no such type."""
        part = _chosen(part, names)
        kind = self._type(path, part, within)
        if kind is None:
            return None
        count, is_array = self._count(path, part, names), part.count is not None
        if count is POISON:
            self.graph.gaps[path] = Gap()
        elif count == 0:
            self.graph.gaps[path] = Gap(frozenset(self._kinds(part)), is_empty=True)
        paths = [f"{path}[{index}]" if is_array else path for index in range(count or 0)]
        for index, instance in enumerate(paths):
            self._count_one(path, part)
            scope = {**names, "index": index} if is_array else names
            priority = self._priority(instance, kind, part, scope)
            if isinstance(kind, CompositeText):
                inside = self.resolver.parameters(instance, kind, part.values, scope, part.position)
                if "index" in scope:
                    inside.setdefault("index", scope["index"])
                self.composite(instance, kind, inside, part.position, within, is_refinement=is_refinement)
            else:
                self._actor(instance, kind, part, scope)
            if (component := self.graph.components.get(instance)) is not None:
                component.priority, component.tags = priority, tuple(tag.text for tag in part.tags)
        if isinstance(kind, CompositeText):
            return Member(kind.name, paths, is_array, count, list(kind.inputs), list(kind.outputs))
        return member_of_actors(kind, paths, is_array, count, self.graph)

    def _others(
        self, path: str, composite: CompositeText, part: PartText, names: Names, within: tuple[str, ...]
    ) -> list[Member]:
        """What a part would be with the other types that it may have, made once of each class to check them."""
        if not part.choices or (composite.name, part.name) in self._tried:
            return []
        self._tried.add((composite.name, part.name))
        chosen = _chosen(part, names)
        others = [each for each in part.choices.values() if each is not chosen]
        with self._trial_at(path) as trial:
            trial.resolver = ParameterResolver(self.problems, budget=self.resolver.budget)
            return [member for each in others if (member := trial.instances(path, each, names, within))]

    @contextmanager
    def _trial_at(self, path: str) -> Iterator[Instantiator]:
        """What makes parts at a path only to find problems in them."""
        trial = copy(self)
        trial.graph, trial.aspects, trial.actors = self.graph.part(self.graph.director_of(path)), [], []
        try:
            yield trial
        finally:
            self.cost = trial.cost

    # -- one entry of ``actors`` ----------------------------------------------------------------------------------

    def _type(self, path: str, part: PartText, within: tuple[str, ...]) -> CompositeText | type[Actor] | None:
        """The type of a part; None, and a problem, if it cannot have that type."""
        known, wanted, at = self.known_at(path), part.type.text, part.type.position
        inner = known.composites.get(wanted)
        try:
            found = known.catalogue.actors.get(wanted) if inner is None else inner
        except CatalogueError as error:
            self.resolver.blame(path, error, at, Locals(path))
            return None
        if found is POISON or "${" in wanted:
            return None
        if found is None:
            near = wanted, [*known.composites, *known.catalogue.actors]
            hints, message = known.valid_types("actor", wanted), f"{path}: there is no actor type {wanted!r}"
            self.problems.add(message, at, *hints, scope=path, kind=UNKNOWN_TYPE, near=near)
        elif part.inherit:
            message = f"{path}: {wanted} cannot inherit, as it is a type of a dialect"
            hint = "write what it takes as 'name: ${name}'"
            self.problems.add(message, part.inherit[0].position, hint, scope=path, kind=TAKEN)
        elif wanted in within:
            way = " -> ".join([*within[within.index(wanted) :], wanted])
            message = f"{path}: composite {wanted} contains itself: {way}"
            self.problems.add(message, at, scope=path, kind=CLASS)
        elif len(within) >= MAX_DEPTH:
            message = f"{path}: composites are nested deeper than {MAX_DEPTH} levels"
            self.problems.add(message, at, kind=SIZE)
        else:
            return found
        return None

    def known_at(self, path: str) -> PartTypes:
        """The possible types of a part, under its director."""
        dialect = self.graph.domain_of(path).dialect
        if dialect not in self._like:
            self._like[dialect] = self.known.like(dialect)
        return self._like[dialect]

    def _count(self, path: str, part: PartText, names: Names) -> int | Poison:
        """The number of instances."""
        if part.count is None:
            return 1
        count = Parameter(int, min=0, max=self.graph.limits.actors)
        local, node = Locals(path, names), part.count.node
        found: int | Poison = self.resolver.converted(node, local, f"{path}: count", count.convert)
        return found

    def _count_one(self, path: str, part: PartText) -> None:
        """Count one more instance; raises ``TooLargeError`` if there are too many."""
        self.cost += 1
        most = self.graph.limits.actors if self._trial is None else self._trial
        if self.cost > most:
            if self._trial is None:
                message = f"{path}: the model has more than {most:,} actors and composites"
                self.problems.add(message, part.position, RAISE_IT, kind=SIZE)
            raise TooLargeError

    def _kinds(self, part: PartText) -> set[str]:
        """The types and tags that an instance of this part, and the parts in it, would have."""
        found: set[str] = set()
        waiting, seen = [part], set[str]()
        while waiting:
            each = waiting.pop()
            found |= {each.type.text, *(tag.text for tag in each.tags)}
            waiting += each.choices.values()
            if (inner := self.known.composites.get(each.type.text)) and inner.name not in seen:
                seen.add(inner.name)
                waiting += inner.actors.values()
        return found

    def _priority(self, path: str, kind: object, part: PartText, names: Names) -> int:
        """The priority of an actor, or of a composite that fires as one."""
        if part.priority is None:
            return 0
        if isinstance(kind, CompositeText) and kind.director is None:
            message = f"{path}: {kind.name} has no priority, because its actors fire one by one"
            hint = f"give the actors inside a priority, or give {kind.name} its own director: 'director: {{}}'"
            self.problems.add(message, part.priority.position, hint, scope=path, kind=DIRECTOR)
            return 0
        return self.resolver.value(part.priority, Locals(path, names), f"{path}: priority") or 0

    def _actor(self, path: str, actor_type: type[Actor], part: PartText, names: Names) -> None:
        local = Locals(path, names)

        def make(**values: object) -> Actor:
            made = actor_type(path, **values)
            self.graph.add_actor(made, part.position)
            return made

        actor = self.resolver.configured(actor_type, part.values, local, path, part.position, make=make, path=path)
        if isinstance(actor, Poison):
            self.graph.leave_out(path, actor_type)
        else:
            self.actors.append(actor)

    # -- composites -----------------------------------------------------------------------------------------------

    def composite(
        self,
        path: str,
        composite: CompositeText,
        inside: Names,
        position: Position | None,
        within: tuple[str, ...] = (),
        *,
        is_refinement: bool = False,
    ) -> None:
        """One instance of a composite, its ports and its parts; ``inside`` are its parameters."""
        graph = self.graph
        self.classes.add(composite.name)
        graph.add_component(path, composite.name, position)
        for direction in ("input", "output"):
            for name, port in composite.ports(direction).items():
                kind = self._port_type(composite, port)
                graph.add_composite_port(f"{path}.{name}", direction, kind, port.position)
        if is_refinement:
            graph.add_refinement(path)
        elif composite.director is None and composite.refinements:
            graph.add_director(path)
        elif composite.director is not None:
            graph.add_director(path, **self._director(path, path, composite.director, inside))
        self.body(path, composite, inside, (*within, composite.name))

    def dialect(self, model: CompositeText, names: Names) -> None:
        """The dialect of the model's director."""
        if like := self._director(model.name, "", model.director or {}, names).get("like"):
            self.graph.domains[""].dialect = like

    def _director(self, what: str, path: str, given: Mapping[str, Computed], names: Names) -> dict[str, Any]:
        """The settings of a director; wrong ones are left out."""
        local = Locals(path, names)
        return sound({key: self.resolver.value(each, local, f"{what}: director.{key}") for key, each in given.items()})

    def _port_type(self, composite: CompositeText, port: PortText) -> Any:
        """The type that a composite declares for a port; None if it declares none, or an unknown one."""
        if port.type is None:
            return None
        text = port.type.text
        if text not in self._port_types:
            try:
                self._port_types[text] = read_type(text, self._tokens)
            except FaultError as error:
                self._port_types[text] = error
        found = self._port_types[text]
        if isinstance(found, FaultError):
            self.resolver.blame(f"port {port.name!r} of {composite.name}", found, port.type.position, Locals())
            return None
        return found

    # -- aspects that are models ----------------------------------------------------------------------------------

    def _aspect_model(
        self, path: str, composite: CompositeText, part: PartText, names: Names, within: tuple[str, ...]
    ) -> Member | None:
        """Make the composite of an aspect; if it is not enabled, only to check it."""
        full, graph = paths.join(path, part.name), self.graph
        is_port = part.name in composite.inputs or part.name in composite.outputs
        if is_port or part.name in composite.actors or full in graph.components:
            clash = "a port" if is_port else "an actor"
            message = f"{full!r} is the name of both {clash} and an aspect that is a model"
            self.problems.add(message, part.position, "rename one", kind=NAME)
            return None
        if self.resolver.is_enabled(full, part, Locals(path, names)):
            return self.instances(full, as_actor(part), names, within)
        with self._trial_at(full) as trial:
            trial.instances(full, as_actor(part), names, within)
        self.graph.gaps[full] = Gap()
        return None


def _chosen(part: PartText, names: Mapping[str, object]) -> PartText:
    """A part with the type that a parameter chooses; with the first one, if its value is not known."""
    if not part.choices:
        return part
    first, *_ = part.choices.values()
    value = names.get(part.type.text.strip("${ }"))
    return part.choices.get(value, first) if isinstance(value, str) else first
