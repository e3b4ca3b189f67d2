"""From the pointcuts of an aspect to its places, and from these to an aspect that is attached to them.

A pointcut is a pattern of ports (``observer[*].plan_in``), of a connection (``a.out -> b.in``), or a selection by the
type of an actor or composite, or by a tag that the model's author gave it, with the name of a port.  A pattern after
``!`` excludes what it selects.  An aspect that attaches to actors selects these by their paths, or a composite for all
actors in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from epicycle.actors import declared_parameters, nearest, paths
from epicycle.aspects import Aspect

from ...support.shown import listed
from ..graph.acts import connection_place
from ..graph.woven import Places, WovenAspect
from ..language.places import PointcutText
from ..text.kinds import NO_PLACE
from ..text.patterns import PatternError, in_general
from ..text.problems import POISON, Poison, Position
from .paths import PlaceOf, View, unknown_inputs

Aimed = dict[str, PointcutText]  # the last pointcut that selects each place, or the outermost composite around it


@dataclass
class Pointcuts(View):
    """Resolves the pointcuts of one aspect of the class ``cls``; it changes nothing.

    An aspect that is the composite at the path ``own`` attaches to nothing in it.
    """

    cls: type[Aspect]
    own: str = ""

    @property
    def kind(self) -> str:
        return self.graph.components[self.own].kind if self.own else self.cls.__name__

    def resolve(self, at: Sequence[PointcutText | Poison]) -> tuple[Places, Aimed]:
        """The places, and the last pointcut that selects each; one that selects nothing is a problem."""
        found = [(each, self._places_of(each)) for each in at if each]
        included = [(pointcut, chosen) for pointcut, chosen in found if chosen and not pointcut.exclude]
        left_out = {place for pointcut, chosen in found if chosen and pointcut.exclude for place in chosen.places}
        connections = {connection_place(*ends): ends for _, chosen in included for ends in chosen.connections}
        parameters = dict.fromkeys(path for _, chosen in included for path in chosen.parameters)
        aimed = {place: pointcut for pointcut, chosen in included for place in chosen.places}
        units: dict[str, str] = {}  # of an actor that several pointcuts select, the outermost composite counts
        for pointcut, chosen in included:
            for actor, unit in chosen.actors.items():
                if len(unit) <= len(units.get(actor, unit)):
                    units[actor], aimed[actor] = unit, pointcut
        places = Places(
            ports=self.ports.in_order({port for _, chosen in included for port in chosen.ports} - left_out),
            connections=[ends for place, ends in connections.items() if left_out.isdisjoint((place, ends[1]))],
            actors={each: units[each] for each in self.paths.actors.in_order(units.keys() - left_out)} if units else {},
            parameters=[path for path in parameters if path not in left_out],
        )
        for pointcut, each in found:
            if each and pointcut.exclude and each.connections and connections.keys().isdisjoint(each.places):
                hint = "exclude ports from ports and connections from connections: select some, as in '*.out -> b.in'"
                self.tell(f"'!{pointcut.text}' excludes no selected connection", pointcut, hint)
        if found and not places.places and POISON not in (*at, *(each for _, each in found)):
            only_out = all(pointcut.exclude for pointcut, _ in found)
            nowhere = "'at' has only exclusions" if only_out else "'at' excludes everything that it selects"
            self.tell(nowhere, found[0][0], kind=NO_PLACE)
        return places, aimed

    def _places_of(self, pointcut: PointcutText) -> Places | Poison:
        """What one pointcut selects; poison if it rightly selects nothing, or what is wrong with it is reported."""
        chosen: Places | Poison = POISON
        if not self.cls.at_ports:
            if units := self._units_of(pointcut):
                chosen = self._actors_in(units)
        elif pointcut.ends is not None:
            if connections := self._connections_of(pointcut):
                chosen = Places(connections=connections)
        elif (parameters := self._parameters_of(pointcut)) is None:
            if (ports := self._ports_of(pointcut)) is not POISON:
                chosen = Places(ports=ports)
        elif parameters:
            chosen = Places(parameters=parameters)
        return chosen and self._outside(pointcut, chosen)

    def _outside(self, pointcut: PointcutText, places: Places) -> Places | Poison:
        """Those of the places that are not in the aspect's own composite."""
        left = places.without(self.own) if self.own else places
        if places.places and not left.places and not pointcut.exclude:
            first, *_ = (*places.actors.values(), *places.places)
            return self.tell(f"it cannot attach to its own inside, at {first}", pointcut)
        return left

    # -- ports, connections and parameters ------------------------------------------------------------------------

    def _ports_of(self, pointcut: PointcutText) -> list[str] | Poison:
        """The ports that the aspect can attach to, of those that one pointcut selects."""
        found = self._matching(pointcut) if pointcut.is_pattern else self._chosen(pointcut)
        fitting = [port for port in found or () if self._fits(port)]
        if found and not fitting:
            where = " or ".join(sorted(self.cls.stands_at))
            other = f"{found[0]} is an {self.graph.direction(found[0])} port"
            return self.tell(f"{self.kind} attaches to {where} ports, but {other}", pointcut, *self._across(found[0]))
        return POISON if found is POISON else fitting

    def _across(self, port: str) -> list[str]:
        """The ports at the other ends of a port's connections, if the aspect can attach to them."""
        edges = [edge for edge in self.graph.edges if port in (edge.source, edge.destination)]
        ends = [edge.destination if edge.source == port else edge.source for edge in edges]
        names = [paths.relative(end, self.scope) for end in ends if self._fits(end)]
        return [f"it is connected to {listed(names, most=3)}, where it can attach"] if names else []

    def _parameters_of(self, pointcut: PointcutText) -> list[str] | Poison | None:
        """The parameters that a pointcut selects; None if it selects ports.

        It selects parameters because it says so, or because it matches no suitable port.  A pattern must name the
        parameter in full: ``sensor.*`` are ports.
        """
        said, pattern = pointcut.parameter, self._full(pointcut.text)
        owner, _, name = pattern.rpartition(".")
        if said is None and (not pointcut.text or not owner or "*" in name):
            return None
        if not self.cls.alters_parameters:
            return (
                None if said is None else self.tell(f"{self.kind} alters no parameters", said, "leave 'parameter' out")
            )
        if said is not None:
            chosen, name = self._chosen_owners(pointcut), said.text
            if chosen is POISON:
                return POISON
            actors = [path for path in self.graph.actors if path in chosen]
        else:
            try:
                if any(self._fits(port) for port in self.ports.select(pattern)):
                    return None
                actors = self.paths.actors.select(owner)
            except PatternError:
                return None  # which is reported of it as a pattern of ports
        having = [path for path in actors if name in declared_parameters(type(self.graph.actors[path]))]
        if said is not None and not having:
            names = sorted({each for path in actors for each in declared_parameters(type(self.graph.actors[path]))})
            hint = f"their parameters: {', '.join(names) or 'none'}"
            message = f"no {_asked(pointcut)} has a parameter {name!r}"
            return self.tell(message, said, hint, kind=NO_PLACE, near=(name, names))
        if not having:
            return None
        found = [f"{path}.{name}" for path in having if pointcut.exclude or self._can_alter(path, name, pointcut)]
        return found or POISON

    def _parameter_meant(self, pattern: str) -> tuple[str, ...]:
        """Advice: the parameter of an actor that a pattern nearly names."""
        owner, _, name = pattern.rpartition(".")
        if not self.cls.alters_parameters or owner not in self.graph.actors:
            return ()
        meant = nearest(name, declared_parameters(type(self.graph.actors[owner])))
        return () if meant is None else (f"{owner} has a parameter {meant!r}",)

    def _can_alter(self, actor: str, name: str, pointcut: PointcutText) -> bool:
        """Check that a parameter of an actor holds what the aspect alters, and nothing else sets it."""
        path, parameter = f"{actor}.{name}", declared_parameters(type(self.graph.actors[actor]))[name]
        hints: tuple[str, ...] = ()
        if self.cls.alters_numbers and parameter.type not in (int, float, int | float):
            message = f"{self.kind} alters numbers, but {path} is {parameter.describe_type()}"
        elif self.cls.alters_numbers and parameter.value_in(self.graph.actors[actor]) is None:
            message = f"{self.kind} alters numbers, but {path} has no value"
        elif path in self.graph.ports and self.graph.incoming(path):
            message, sender = f"{path} gets its values over a connection", self.graph.incoming(path)[0].source
            hints = (f"attach the aspect to {sender!r}, where they come from",)
        else:
            return True
        self.tell(message, pointcut, *hints, about=("altered", in_general(path)))
        return False

    def _matching(self, pointcut: PointcutText) -> list[str] | Poison:
        """The ports that a pattern selects."""
        full = self._full(pointcut.text)
        try:
            found = self.ports.select(full)
        except PatternError as error:
            return self._no_pattern(pointcut, error, "[a.in, b.in]")
        if found:
            return found
        if self.graph.excuses(full):
            return POISON
        near = self.ports.near(pointcut.text, self.scope, self._fits)
        advice = self.ports.advice(pointcut.text, self.scope, self._fits)
        hints = (*advice, *self._parameter_meant(full))
        return self.tell(f"{pointcut.text!r} matches no port", pointcut, *hints, kind=NO_PLACE, near=near)

    def _no_pattern(self, pointcut: PointcutText, error: PatternError, example: str) -> Poison:
        several = (f"for several pointcuts, write a list: {example}",) if example and "," in pointcut.text else ()
        return self.tell(f"{pointcut.text!r} is not a pointcut: {error}", pointcut, *several, kind=NO_PLACE)

    def _chosen(self, pointcut: PointcutText) -> list[str] | Poison:
        """The ports of the actors and composites of a type, or with a tag."""
        owners = self._chosen_owners(pointcut)
        if owners is POISON:
            return POISON
        of_owners = dict.fromkeys(path for owner in owners for path in self.ports.inside(owner))
        ports = self.ports.in_order(path for path in of_owners if paths.parent(path) in owners)
        if pointcut.port is None:
            found = [path for path in ports if self._fits(path)]
            if not found and not any(path in self.graph.gaps for path in owners):
                wanting = " or ".join(sorted(self.cls.stands_at))
                where = pointcut.type or pointcut.tag
                return self.tell(f"{self.kind} attaches to {wanting} ports, but no {_asked(pointcut)} has one", where)
            return found
        found = [path for path in ports if paths.name(path) == pointcut.port.text]
        if not found:
            names = sorted({*map(paths.name, ports)})
            hint = f"their ports: {', '.join(names) or 'none'}"
            message, near = f"no {_asked(pointcut)} has a port {pointcut.port.text!r}", (pointcut.port.text, names)
            return self.tell(message, pointcut.port, hint, kind=NO_PLACE, near=near)
        return found

    def _chosen_owners(self, pointcut: PointcutText) -> set[str] | Poison:
        """The actors and composites of a type, or with a tag."""
        paths = self.paths.holders.inside(self.scope)
        self.paths.holders.spend(len(paths))
        inside = {path: self.graph.components[path] for path in paths}
        if pointcut.type is not None:
            wanted, known = pointcut.type, {each.kind for each in inside.values()}
            owners = {path for path, each in inside.items() if each.kind == wanted.text}
        else:
            assert pointcut.tag is not None
            wanted, known = pointcut.tag, {tag for each in inside.values() for tag in each.tags}
            owners = {path for path, each in inside.items() if wanted.text in each.tags}
        if owners:
            return owners
        if self.graph.may_hold(wanted.text, self.scope):
            return POISON
        what = "types" if pointcut.type is not None else "tags"
        hint = f"{what} here: {', '.join(sorted(known)) or 'none'}"
        near = wanted.text, sorted(known | self.graph.missing_kinds)
        return self.tell(f"there is no {_asked(pointcut)}", wanted, hint, kind=NO_PLACE, near=near)

    def _connections_of(self, pointcut: PointcutText) -> list[tuple[str, str]] | Poison:
        """The connections that one pointcut selects."""
        if "input" not in self.cls.stands_at:
            return self.tell(f"{self.kind} attaches to output ports, not to connections", pointcut)
        assert pointcut.ends is not None
        left, right = map(self._full, pointcut.ends)
        try:
            ends = set(self.ports.select(right))
            edges = [edge for source in self.ports.select(left) for edge in self.graph.outgoing(source)]
        except PatternError as error:
            return self._no_pattern(pointcut, error, "")
        found = [(edge.source, edge.destination) for edge in edges if edge.destination in ends]
        if found:
            return found
        if self.graph.excuses(left) or self.graph.excuses(right):
            return POISON
        near = connection_place(left, right), map(str, self.graph.edges)
        return self.tell(f"{pointcut.text!r} matches no connection", pointcut, kind=NO_PLACE, near=near)

    def _fits(self, port: str) -> bool:
        """Whether the aspect can attach to a port."""
        return self.graph.direction(port) in self.cls.stands_at

    # -- actors ---------------------------------------------------------------------------------------------------

    def _actors_in(self, units: Sequence[str]) -> Places | Poison:
        """The actors among actors and composites, each with the outermost that holds it; poison if none was made."""
        index, known, actors = self.paths.owners, self.paths.holders, self.paths.actors
        found: dict[str, str] = {}
        for unit in units:
            for actor in (each for each in (unit, *actors.inside(unit)) if each in actors):
                found.setdefault(actor, unit)
        is_whole = all(each in known for unit in units for each in (unit, *index.inside(unit)))
        return Places(actors=found) if found or is_whole else POISON

    def _units_of(self, pointcut: PointcutText) -> list[str] | Poison:
        """The actors and composites that one pointcut selects, outer ones first."""
        name, text, index = self.kind, pointcut.text, self.paths.owners
        for key, said in (("port", pointcut.port), ("parameter", pointcut.parameter)):
            if said is not None:
                self.tell(f"{name} attaches to actors, not to their {key}s", said, f"leave {key!r} out")
        if not pointcut.is_pattern:
            owners = self._chosen_owners(pointcut)
            return POISON if owners is POISON else sorted(owners)
        if pointcut.ends is not None:
            receiver = paths.parent(pointcut.ends[1])
            hints = (f"write {receiver!r} for the receiving actor",) if receiver else ()
            return self.tell(f"{name} attaches to actors, not to connections", pointcut, *hints)
        full = self._full(text)
        try:
            found, ports = index.select(full), self.ports.select(full)
        except PatternError as error:
            return self._no_pattern(pointcut, error, "[a, b]")
        if found:
            return found
        if self.graph.excuses(f"{full}.*"):
            return POISON
        if ports and "." in text:
            hint = f"write {text.rpartition('.')[0]!r}, without the port"
            return self.tell(f"{name} attaches to actors, but {ports[0]} is a port", pointcut, hint)
        inside = (paths.relative(path, self.scope) for path in index.inside(self.scope))
        near = sorted(path for path in inside if path.count(".") == text.count("."))
        hint = f"actors and composites at this depth: {', '.join(near) or 'none'}"
        around = index.near(text, self.scope)
        return self.tell(f"{text!r} matches no actor", pointcut, hint, kind=NO_PLACE, near=around)

    def bind(self, aspect: Aspect, places: Places, place_of: PlaceOf, position: Position) -> WovenAspect:
        """The aspect at its places, with everything that it reads.

        ``place_of`` returns where something is wrong with its parameters in the model file.
        """
        of_it = self.read_by(aspect, places.ports, place_of)
        woven = WovenAspect(name=self.name, aspect=aspect, position=position, **vars(places), **of_it)
        for fault in unknown_inputs(woven, self.graph):  # of execution times by input port
            self.tell(fault.message, place_of(fault), *fault.help)
        return woven


def _asked(pointcut: PointcutText) -> str:
    """What a pointcut by type or tag asks for."""
    if pointcut.type is not None:
        return f"actor of type {pointcut.type.text!r}"
    return f"actor with the tag {pointcut.tag.text if pointcut.tag is not None else ''!r}"
