"""From aspect declarations to aspects attached to ports and connections.

A pointcut is a pattern of ports (``observer[*].plan_in``), of a connection (``a.out -> b.in``), or a selection by the
type of an actor or composite, or by a tag that the model's author gave it, with the name of a port.  A pattern after
``!`` excludes what it selects.  An aspect that attaches to actors selects these by their paths, or a composite for all
actors in it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from epicycle.actors import declared_parameters
from epicycle.aspects import Aspect

from ..graph import WovenAspect, connection_place
from ..language import PointcutText
from ..text import PathIndex, PatternError, Poison, did_you_mean, in_general, nearest
from .looks import Looks, PlaceOf, unknown_inputs
from .paths import View


@dataclass
class Weaving(View):
    """Finds the places of one aspect of the class ``cls``."""

    cls: type[Aspect]
    _parameters: dict[str, bool] = field(default_factory=dict, init=False)  # selected ones, and whether excluded
    _left_out: set[str] = field(default_factory=set, init=False)  # excluded ports, and the connections to them
    _is_excused: bool = field(default=False, init=False)  # whether a pointcut rightly selects nothing

    @property
    def kind(self) -> str:
        return self.cls.__name__

    def weave(self, aspect: Aspect, at: Sequence[PointcutText | Poison], place_of: PlaceOf) -> WovenAspect:
        """The aspect with its places and everything it reads; a pointcut that selects nothing is a problem.

        ``place_of`` returns where something is wrong with its parameters in the model file.
        """
        before = len(self.problems)
        pointcuts = [each for each in at if each]
        self._is_excused = len(pointcuts) < len(at)
        ports, connections, actors = self.select(pointcuts)
        parameters = [path for path, is_left_out in self._parameters.items() if not is_left_out]
        is_somewhere = ports or connections or actors or parameters
        if pointcuts and not is_somewhere and not self._is_excused and len(self.problems) == before:
            only_out = all(pointcut.exclude for pointcut in pointcuts)
            nowhere = "'at' has only exclusions" if only_out else "'at' excludes everything that it selects"
            self._problem(nowhere, pointcuts[0])
        looks = Looks(self.draft, self.paths, self.name, self.scope, self.problems)
        readings, selections, reads = looks.of(aspect, ports, place_of)
        woven = WovenAspect(
            self.name, aspect, ports, connections, actors, readings, selections, reads, parameters=parameters
        )
        self.check_times(woven, place_of)
        return woven

    def check_times(self, woven: WovenAspect, place_of: PlaceOf) -> None:
        """Check that execution times by input port name ports that the actors have."""
        for fault in unknown_inputs(woven, self.graph):
            self._problem(fault.message, place_of(fault), *fault.help)

    def select(self, pointcuts: Sequence[PointcutText]) -> tuple[list[str], list[tuple[str, str]], dict[str, str]]:
        """The ports, connections and actors that the pointcuts select."""
        if not self.cls.at_ports:
            return [], [], self._select_actors(pointcuts)
        of_ports = [pointcut for pointcut in pointcuts if pointcut.ends is None]
        chosen = {port for pointcut in of_ports if not pointcut.exclude for port in self._of(pointcut)}
        self._left_out = {port for pointcut in of_ports if pointcut.exclude for port in self._of(pointcut)}
        return self.ports.in_order(chosen - self._left_out), self._select_connections(pointcuts), {}

    def _of(self, pointcut: PointcutText) -> list[str]:
        """The ports that the aspect can attach to, of those that one pointcut selects."""
        if self._stands_at_parameters(pointcut):
            return []
        found = self._matching(pointcut) if pointcut.text else self._chosen(pointcut)
        if found is None:
            return []
        fitting = [port for port in found if self._fits(port)]
        if found and not fitting:
            where = " or ".join(sorted(self.cls.stands_at))
            other = f"{found[0]} is an {self.graph.direction(found[0])} port"
            self._problem(f"{self.kind} attaches to {where} ports, but {other}", pointcut)
        return fitting

    def _stands_at_parameters(self, pointcut: PointcutText) -> bool:
        """Whether a pointcut selects parameters of actors: because it says so, or because it matches no suitable port.

        A pattern must name the parameter in full: ``sensor.*`` are ports.
        """
        said, pattern = pointcut.parameter, self._full(pointcut.text)
        owner, _, name = pattern.rpartition(".")
        if said is None and (not pointcut.text or not owner or "*" in name):
            return False
        if not self.cls.alters_parameters:
            if said is not None:
                self._problem(f"{self.kind} alters no parameters", said, "leave 'parameter' out")
            return said is not None
        if said is not None:
            chosen, name = self._chosen_owners(pointcut), said.text
            actors = None if chosen is None else [path for path in self.graph.actors if path in chosen]
        else:
            try:
                if any(self._fits(port) for port in self.ports.select(pattern)):
                    return False
                actors = self.paths.actors.select(owner)
            except PatternError:
                return False  # which is reported of it as a pattern of ports
        having = [path for path in actors or () if name in declared_parameters(type(self.graph.actors[path]))]
        if said is not None and actors is not None and not having:
            names = sorted({each for path in actors for each in declared_parameters(type(self.graph.actors[path]))})
            hint = f"their parameters: {', '.join(names) or 'none'}"
            self._problem(f"no {_asked(pointcut)} has a parameter {name!r}{did_you_mean(name, names)}", said, hint)
        for path in having:
            self._enter_parameter(path, name, pointcut)
        return bool(having) or said is not None

    def _parameter_meant(self, pattern: str) -> tuple[str, ...]:
        """Advice: the parameter of an actor that a pattern nearly names."""
        owner, _, name = pattern.rpartition(".")
        if not self.cls.alters_parameters or owner not in self.graph.actors:
            return ()
        meant = nearest(name, declared_parameters(type(self.graph.actors[owner])))
        return () if meant is None else (f"{owner} has a parameter {meant!r}",)

    def _enter_parameter(self, actor: str, name: str, pointcut: PointcutText) -> None:
        """Add a parameter of an actor, if it holds what the aspect alters and nothing else sets it."""
        path, parameter = f"{actor}.{name}", declared_parameters(type(self.graph.actors[actor]))[name]
        about = ("altered", in_general(path))
        if pointcut.exclude:
            self._parameters[path] = True
        elif self.cls.alters_numbers and parameter.type not in (int, float, int | float):
            self._problem(
                f"{self.kind} alters numbers, but {path} is {parameter.describe_type()}", pointcut, about=about
            )
        elif self.cls.alters_numbers and parameter.value_in(self.graph.actors[actor]) is None:
            self._problem(f"{self.kind} alters numbers, but {path} has no value", pointcut, about=about)
        elif path in self.graph.ports and self.graph.incoming(path):
            sender = self.graph.incoming(path)[0].source
            hint = f"attach the aspect to {sender!r}, where they come from"
            self._problem(f"{path} gets its values over a connection", pointcut, hint, about=about)
        else:
            self._parameters.setdefault(path, False)

    def _matching(self, pointcut: PointcutText) -> list[str] | None:
        full = self._full(pointcut.text)
        try:
            found = self.ports.select(full)
        except PatternError as error:
            several = ("for several pointcuts, write a list: [a.in, b.in]",) if "," in pointcut.text else ()
            self._problem(f"{pointcut.text!r} is not a pointcut: {error}", pointcut, *several)
            return None
        if not found and not self._excuses(full):
            near = self.ports.did_you_mean(pointcut.text, self.scope, self._fits)
            advice = self.ports.advice(pointcut.text, self.scope, self._fits)
            self._problem(f"{pointcut.text!r} matches no port{near}", pointcut, *advice, *self._parameter_meant(full))
        return found

    def _chosen(self, pointcut: PointcutText) -> list[str] | None:
        """The ports of the actors and composites of a type, or with a tag."""
        graph, owners = self.graph, self._chosen_owners(pointcut)
        if owners is None:
            return None
        of_owners = dict.fromkeys(path for owner in owners for path in self.ports.inside(owner))
        ports = self.ports.in_order(path for path in of_owners if graph.owner(path) in owners)
        if pointcut.port is None:
            found = [path for path in ports if self._fits(path)]
            if not found and not any(path in self.draft.gaps for path in owners):
                wanting = " or ".join(sorted(self.cls.stands_at))
                where = pointcut.type or pointcut.tag
                self._problem(f"{self.kind} attaches to {wanting} ports, but no {_asked(pointcut)} has one", where)
            return found
        found = [path for path in ports if path.rpartition(".")[2] == pointcut.port.text]
        if not found:
            names = sorted({path.rpartition(".")[2] for path in ports})
            near = did_you_mean(pointcut.port.text, names)
            message = f"no {_asked(pointcut)} has a port {pointcut.port.text!r}{near}"
            self._problem(message, pointcut.port, f"their ports: {', '.join(names) or 'none'}")
            return None
        return found

    def _chosen_owners(self, pointcut: PointcutText) -> set[str] | None:
        """The actors and composites of a type, or with a tag."""
        graph = self.graph
        kinds = self.paths.kinds
        inside = self.paths.holders.inside(self.scope)
        self.paths.holders.spend(len(inside))
        inside = [path for path in inside if path in kinds]
        if pointcut.type is not None:
            owners = {path for path in inside if kinds[path] == pointcut.type.text}
            wanted, known = pointcut.type, {kinds[path] for path in inside}
        else:
            assert pointcut.tag is not None
            wanted = pointcut.tag
            owners = {path for path in inside if wanted.text in graph.tags.get(path, ())}
            known = {tag for path in inside for tag in graph.tags.get(path, ())}
        if not owners and self.draft.may_hold(wanted.text, self.scope):
            self._is_excused = True
            return None
        if not owners:
            what = "types" if pointcut.type is not None else "tags"
            message = f"there is no {_asked(pointcut)}{did_you_mean(wanted.text, sorted(known | self.draft.kinds))}"
            self._problem(message, wanted, f"{what} here: {', '.join(sorted(known)) or 'none'}")
            return None
        return owners

    def _select_actors(self, pointcuts: Sequence[PointcutText]) -> dict[str, str]:
        """The actors that the pointcuts select, singly or with a composite around them, and what the pointcuts name."""
        index = self.paths.owners
        aimed = {path for pointcut in pointcuts if not pointcut.exclude for path in self._aimed_at(pointcut, index)}
        spared = {path for pointcut in pointcuts if pointcut.exclude for path in self._aimed_at(pointcut, index)}
        known = self.paths.holders
        if any(each not in known for unit in aimed for each in (unit, *index.inside(unit))):
            self._is_excused = True  # there is an actor that could not be made, which has been reported
        found = {}
        actors = self.paths.actors
        chosen = {each for unit in aimed for each in (unit, *actors.inside(unit)) if each in actors}
        for actor in actors.in_order(chosen):
            parts = actor.split(".")
            around = [".".join(parts[:length]) for length in range(1, len(parts) + 1)]
            unit = next((path for path in around if path in aimed), None)
            if unit is not None and not spared.intersection(around):
                found[actor] = unit
        return found

    def _aimed_at(self, pointcut: PointcutText, index: PathIndex) -> Iterable[str]:
        """The actors and composites that one pointcut selects."""
        name, text = self.kind, pointcut.text
        if pointcut.port is not None:
            self._problem(f"{name} attaches to actors, not to their ports", pointcut.port, "leave 'port' out")
        if not text:
            return self._chosen_owners(pointcut) or ()
        if pointcut.ends is not None:
            receiver = pointcut.ends[1].rpartition(".")[0]
            hint = f"write {receiver!r} for the receiving actor"
            self._problem(f"{name} attaches to actors, not to connections", pointcut, hint)
            return ()
        full = self._full(text)
        try:
            found, ports = index.select(full), self.ports.select(full)
        except PatternError as error:
            several = ("for several pointcuts, write a list: [a, b]",) if "," in text else ()
            self._problem(f"{text!r} is not a pointcut: {error}", pointcut, *several)
            return ()
        if not found and not self._excuses(f"{full}.*"):
            if ports and "." in text:
                owner = text.rpartition(".")[0]
                self._problem(
                    f"{name} attaches to actors, but {ports[0]} is a port",
                    pointcut,
                    f"write {owner!r}, without the port",
                )
            else:
                inside = (path.removeprefix(self._full("")) for path in index.inside(self.scope))
                known = sorted(path for path in inside if path.count(".") == text.count("."))
                hint = f"actors and composites at this depth: {', '.join(known) or 'none'}"
                self._problem(f"{text!r} matches no actor{index.did_you_mean(text, self.scope)}", pointcut, hint)
        return found

    def _select_connections(self, pointcuts: Sequence[PointcutText]) -> list[tuple[str, str]]:
        """The single connections that pointcuts of the form ``a.out -> b.in`` select."""
        chosen: dict[tuple[str, str], None] = {}
        for pointcut in sorted(pointcuts, key=lambda each: each.exclude):
            if pointcut.ends is None:
                continue
            found = self._connections_of(pointcut, *pointcut.ends)
            if not pointcut.exclude:
                chosen |= dict.fromkeys(found)
            elif found and not chosen.keys() & found:
                hint = "exclude ports from ports and connections from connections: select some, as in '*.out -> b.in'"
                self._problem(f"'!{pointcut.text}' excludes no selected connection", pointcut, hint)
            else:
                chosen = {each: None for each in chosen if each not in found}
        return [each for each in chosen if each[1] not in self._left_out]

    def _connections_of(self, pointcut: PointcutText, left: str, right: str) -> list[tuple[str, str]]:
        """The connections that one pointcut selects."""
        if "input" not in self.cls.stands_at:
            self._problem(f"{self.kind} attaches to output ports, not to connections", pointcut)
            return []
        try:
            ends = set(self.ports.select(self._full(right)))
            found = [
                (hop.source, hop.destination)
                for source in self.ports.select(self._full(left))
                for hop in self.graph.outgoing(source)
                if hop.destination in ends
            ]
        except PatternError as error:
            self._problem(f"{pointcut.text!r} is not a pointcut: {error}", pointcut)
            return []
        if not found and not (self._excuses(self._full(left)) or self._excuses(self._full(right))):
            near = did_you_mean(connection_place(self._full(left), self._full(right)), map(str, self.graph.hops))
            self._problem(f"{pointcut.text!r} matches no connection{near}", pointcut)
        return found

    def _excuses(self, pattern: str) -> bool:
        """Whether a pattern may match nothing."""
        is_excused = self.draft.excuses(pattern)
        self._is_excused = self._is_excused or is_excused
        return is_excused

    def _fits(self, port: str) -> bool:
        """Whether the aspect can attach to a port."""
        return self.graph.direction(port) in self.cls.stands_at


def _asked(pointcut: PointcutText) -> str:
    """What a pointcut by type or tag asks for."""
    if pointcut.type is not None:
        return f"actor of type {pointcut.type.text!r}"
    return f"actor with the tag {pointcut.tag.text if pointcut.tag is not None else ''!r}"
