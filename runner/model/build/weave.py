"""From the pointcuts of an aspect to its places, and from these to an aspect that is attached to them.

A pointcut is a pattern of ports (``observer[*].plan_in``), of a connection (``a.out -> b.in``), or a selection by the
type of an actor or composite, or by a tag that the model's author gave it, with the name of a port.  A pattern after
``!`` excludes what it selects.  An aspect that attaches to actors selects these by their paths, or a composite for all
actors in it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from epicycle.actors import declared_parameters, nearest, paths
from epicycle.aspects import Aspect

from ...support.shown import listed
from ..graph.acts import connection_place
from ..graph.woven import Places, WovenAspect
from ..language.places import PointcutText
from ..text.kinds import NO_PLACE
from ..text.patterns import PathIndex, PatternError, in_general
from ..text.problems import POISON, Poison, Position
from .paths import PlaceOf, View, unknown_inputs

Ends = tuple[str, str]
Found = tuple[PointcutText, list[str] | Poison]  # what a pointcut selects; poison if it rightly selects nothing
Aimed = dict[str, PointcutText]  # the last pointcut that selects each place, or a composite around it


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
        pointcuts = [each for each in at if each]
        is_sound, places, aimed = (self._at_ports if self.cls.at_ports else self._at_actors)(pointcuts)
        if pointcuts and not places.places and is_sound and POISON not in at:
            only_out = all(pointcut.exclude for pointcut in pointcuts)
            nowhere = "'at' has only exclusions" if only_out else "'at' excludes everything that it selects"
            self.tell(nowhere, pointcuts[0], kind=NO_PLACE)
        return places, aimed

    # -- ports, connections and parameters ------------------------------------------------------------------------

    def _at_ports(self, pointcuts: Sequence[PointcutText]) -> tuple[bool, Places, Aimed]:
        """The places at ports, and whether every pointcut has some."""
        parameters: dict[str, bool] = {}  # whether they are excluded
        of_ports: list[Found] = []
        for pointcut in (each for each in pointcuts if each.ends is None):
            named = self._parameters_of(pointcut)
            if named is None:
                ports = self._ports_of(pointcut)
                of_ports.append((pointcut, ports and self._outside(pointcut, {port: (port,) for port in ports})))
                continue
            for path in named or ():
                parameters[path] = pointcut.exclude or parameters.get(path, False)
            of_ports.append((pointcut, named and []))
        chosen = {port for pointcut, found in of_ports if not pointcut.exclude for port in found or ()}
        left_out = {port for pointcut, found in of_ports if pointcut.exclude for port in found or ()}
        of_connections, connections = self._connections([each for each in pointcuts if each.ends is not None])
        found = [*of_ports, *of_connections]
        places = Places(
            ports=self.ports.in_order(chosen - left_out),
            connections=[ends for ends in connections if ends[1] not in left_out],
            parameters=[path for path, is_left_out in parameters.items() if not is_left_out],
        )
        return _is_sound(found), places, _aimed(found)

    def _outside(self, pointcut: PointcutText, places: Mapping[str, tuple[str, ...]]) -> list[str] | Poison:
        """Of places with their ends, those that are not in the aspect's own composite."""
        left = [place for place, ends in places.items() if not any(map(self._is_own, ends))]
        if places and not left and not pointcut.exclude:
            return self.tell(f"it cannot attach to its own inside, at {next(iter(places))}", pointcut)
        return left

    def _is_own(self, path: str) -> bool:
        return bool(self.own) and paths.is_within(path, self.own)

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

    def _connections(self, pointcuts: Sequence[PointcutText]) -> tuple[list[Found], list[Ends]]:
        """The single connections that pointcuts of the form ``a.out -> b.in`` select."""
        of_each: list[Found] = []
        chosen: dict[str, Ends] = {}
        for pointcut in sorted(pointcuts, key=lambda each: each.exclude):
            ends = self._connections_of(pointcut)
            places = {connection_place(*each): each for each in ends or ()}
            found = POISON if ends is POISON else self._outside(pointcut, places)
            of_each.append((pointcut, found))
            if not pointcut.exclude:
                chosen |= {place: places[place] for place in found or ()}
            elif found and not chosen.keys() & set(found):
                hint = "exclude ports from ports and connections from connections: select some, as in '*.out -> b.in'"
                self.tell(f"'!{pointcut.text}' excludes no selected connection", pointcut, hint)
            else:
                chosen = {place: each for place, each in chosen.items() if place not in (found or ())}
        return of_each, list(chosen.values())

    def _connections_of(self, pointcut: PointcutText) -> list[Ends] | Poison:
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

    def _at_actors(self, pointcuts: Sequence[PointcutText]) -> tuple[bool, Places, Aimed]:
        """The actors that the pointcuts select, singly or with a composite around them; and whether each has some."""
        index, known, actors = self.paths.owners, self.paths.holders, self.paths.actors
        found: list[Found] = []
        for pointcut in pointcuts:
            units = self._units_of(pointcut, index)
            found.append((pointcut, units and self._outside(pointcut, {unit: (unit,) for unit in units})))
        by_unit = _aimed(found)
        spared = {unit for pointcut, units in found if pointcut.exclude for unit in units or ()}
        # Those that could not be made are no actors.
        is_whole = all(each in known for unit in by_unit for each in (unit, *index.inside(unit)))
        chosen = {each for unit in by_unit for each in (unit, *actors.inside(unit)) if each in actors}
        attached: dict[str, str] = {}
        for actor in actors.in_order(each for each in chosen if not self._is_own(each)):
            around = [*reversed(paths.ancestors(actor)), actor]
            unit = next((path for path in around if path in by_unit), None)
            if unit is not None and not spared.intersection(around):
                attached[actor] = unit
        aimed = {actor: by_unit[unit] for actor, unit in attached.items()}
        return is_whole and _is_sound(found), Places(actors=attached), aimed

    def _units_of(self, pointcut: PointcutText, index: PathIndex) -> list[str] | Poison:
        """The actors and composites that one pointcut selects."""
        name, text = self.kind, pointcut.text
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


def _aimed(found: Iterable[Found]) -> Aimed:
    """The last pointcut that selects each place."""
    return {place: pointcut for pointcut, places in found if not pointcut.exclude for place in places or ()}


def _is_sound(found: Iterable[Found]) -> bool:
    return all(places is not POISON for _, places in found)


def _asked(pointcut: PointcutText) -> str:
    """What a pointcut by type or tag asks for."""
    if pointcut.type is not None:
        return f"actor of type {pointcut.type.text!r}"
    return f"actor with the tag {pointcut.tag.text if pointcut.tag is not None else ''!r}"
