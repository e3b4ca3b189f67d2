"""Aspects that are models: a composite class that is woven around ports and becomes part of the graph.

Tokens come in by a *request port*, an input of the composite, and continue when they leave by its *response port*: the
output ``response``, or its only output.  If there are several inputs, a pointcut may name the one that takes its tokens
(``request: in2``); the default is the input ``request``, or the only input.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain

from epicycle.actors import OutputPort, accepts, declared_parameters, type_name
from epicycle.aspects import CompositeAspect, FiringTime, Request

from ..graph import AspectModel, Detour, ModelGraph, WovenAspect, find_loop
from ..language import PartText, PointcutText
from ..text import PathIndex, Position, Problems, did_you_mean
from .looks import without_port
from .settle import place_of
from .weave import Weaving

BY_PLACE = "or name the input that takes the tokens: {at: ..., request: ...}"
OWN = frozenset(declared_parameters(CompositeAspect))  # when it acts: these are not parameters of the composite


def as_actor(part: PartText) -> PartText:
    """The composite in an aspect's declaration, as it would be declared among the actors."""
    values = {name: entry for name, entry in part.values.items() if name not in OWN}
    priority = values.pop("priority").value if "priority" in values else None
    return replace(part, values=values, priority=priority)


@dataclass
class ModelWeaving(Weaving):
    """Finds the places of an aspect that is the composite at ``path``, and connects it with them."""

    path: str
    position: Position
    _response: str = field(default="", init=False)
    _asked: dict[str, str] = field(default_factory=dict, init=False)  # the request port of each place
    # With "" for one that is unknown, which has been reported.
    _request_ports: dict[str, None] = field(default_factory=dict, init=False)
    _times: dict[str, FiringTime] = field(default_factory=dict, init=False)
    _is_misplaced: bool = field(default=False, init=False)

    def __post_init__(self) -> None:
        self.inputs, self.outputs = self.graph.borders(self.path)

    @property
    def kind(self) -> str:
        return self.graph.composites[self.path]

    def check(self, woven: WovenAspect) -> None:
        """Find the ports by which tokens come in and leave, and check that the composite can attach to its places."""
        self._response = self._only(self.outputs, "response", "output", self.position)
        if not self._request_ports:
            self._request(PointcutText("", self.position))
        for port in filter(None, self._request_ports):
            for hop in self.graph.incoming(port):
                message = f"{port} takes the tokens of this aspect, so nothing else can be connected to it"
                self._problem(message, hop.position, "add another input for other tokens")
            if isinstance(self.graph.ports[port].port, OutputPort):
                hint = "attach that aspect here, too, or add another composite"
                self._problem(f"{self.path} is already the model of another aspect", self.position, hint)
        self._check_types()
        self._check_directors(woven)

    def connect(self, woven: WovenAspect) -> WovenAspect:
        """Let the tokens of all places come in, and continue when they are answered."""
        if "" in self._request_ports:
            self.draft.leave_open(self.path)
        for port in filter(None, self._request_ports):
            for hop in list(self.graph.incoming(port)):  # a problem that has been reported
                self.graph.disconnect(hop)
            self.graph.open_requests(port)
        if self._response:
            self.graph.ports[self._response].type = Request
        if not self._response or self._is_misplaced:
            return woven
        return replace(woven, model=AspectModel(self.path, self.kind, self._response, self._asked, self._times))

    def select(self, pointcuts: Sequence[PointcutText]) -> tuple[list[str], list[tuple[str, str]], dict[str, str]]:
        ports, connections, actors = super().select(pointcuts)
        actors = {actor: unit for actor, unit in actors.items() if not self._is_inside(actor)}
        # Exclusions may remove what a pointcut selects; a pointcut for actors may name the composite around them.
        aimed = {place: place for place in (*ports, *(_place(*ends) for ends in connections))} | actors
        asked, times = self._asked, self._times
        self._asked = {place: asked[unit] for place, unit in aimed.items() if unit in asked}
        self._times = {place: times[unit] for place, unit in aimed.items() if unit in times}
        return ports, connections, actors

    def _aimed_at(self, pointcut: PointcutText, index: PathIndex) -> list[str]:
        found = list(super()._aimed_at(pointcut, index))
        outside = [path for path in found if path != self.path and not self._is_inside(path)]
        self._ask(pointcut, outside, found)
        if not pointcut.exclude:
            self._times.update(dict.fromkeys(outside, pointcut.firing_time))
            inside = [path for path in self.graph.actors if any(f"{path}.".startswith(f"{each}.") for each in outside)]
            for message, keys, advice in without_port(("time",), pointcut.firing_time, inside, self.graph):
                time = pointcut.time
                where = pointcut.position if time is None else place_of(time, keys[1:], of_key=True)
                self._problem(message, where, advice)
        return outside

    def _of(self, pointcut: PointcutText) -> list[str]:
        found = super()._of(pointcut)
        outside = [port for port in found if not self._is_inside(port)]
        self._ask(pointcut, outside, found)
        return outside

    def _connections_of(self, pointcut: PointcutText) -> list[tuple[str, str]]:
        found = super()._connections_of(pointcut)
        outside = [ends for ends in found if not any(map(self._is_inside, ends))]
        self._ask(pointcut, [_place(*ends) for ends in outside], [_place(*ends) for ends in found])
        return outside

    def _ask(self, pointcut: PointcutText, places: list[str], found: list[str]) -> None:
        """Note by which port the tokens of the places come in; if several pointcuts select a place, the last counts."""
        if pointcut.exclude:
            return
        if found and not places:
            self._problem(f"it cannot attach to its own inside, at {found[0]}", pointcut)
        if request := self._request(pointcut):
            self._asked.update(dict.fromkeys(places, request))

    def _request(self, pointcut: PointcutText) -> str:
        """The port by which the tokens of a pointcut come in."""
        asked = pointcut.request
        if asked is None:
            found = self._only(self.inputs, "request", "input", pointcut.position, BY_PLACE)
        else:
            found = f"{self.path}.{asked.text}"
            if found not in self.inputs:
                names = _names(self.inputs)
                hint = f"its inputs: {', '.join(names) or 'none'}"
                self._problem(f"{self.kind} has no input {asked.text!r}{did_you_mean(asked.text, names)}", asked, hint)
                found = ""
        self._request_ports[found] = None
        return found

    def _only(self, ports: list[str], name: str, direction: str, position: Position, hint: str = "") -> str:
        """The port of that name, or the only one of its direction."""
        named = f"{self.path}.{name}"
        if named in ports or len(ports) == 1:
            return named if named in ports else ports[0]
        if not ports:
            self._problem(f"{self.kind} has no {direction}", position, f"add '{direction}s: [{name}]' to {self.kind}")
        else:
            message = f"{self.kind} has {len(ports)} {direction}s, none of them called {name!r}"
            known = f"its {direction}s: {', '.join(_names(ports))}"
            self._problem(message, position, known, f"call one of them {name!r}" + (f", {hint}" if hint else ""))
        return ""

    def _check_types(self) -> None:
        """Check that the ports take and give requests, if they declare types."""
        for port in filter(None, (*self._request_ports, self._response)):
            node = self.graph.ports[port]
            wanted = node.type
            if wanted is not None and not accepts(wanted, Request):
                what = f"{port.rpartition('.')[2]} of {self.kind} has the type {type_name(wanted)}"
                hint = "leave out its type: the actors inside receive requests, which contain the tokens"
                self._problem(f"{what}, but aspects pass requests", node.declared, hint)

    def _check_directors(self, woven: WovenAspect) -> None:
        """Check that all places are under the composite's own director, which has one order and one time for them."""
        graph, own = self.graph, self.graph.director_of(self.path)
        found = {port: graph.director_of(graph.owner(port)) for port in woven.ports}
        found |= {actor: graph.director_of(actor) for actor in woven.actors}
        for source, destination in woven.connections:
            hop = next(hop for hop in graph.outgoing(source) if hop.destination == destination)
            found[_place(source, destination)] = graph.director_over(hop)
        for place, director in found.items():
            if director != own:
                where, hint = f"outside {own}", f"declare it outside {own}"
                if director:
                    where = f"inside {director}"
                    hint = f"declare it inside {director}, or attach it to the ports of {director}"
                self._problem(f"{place} is {where}, which has its own director", self.position, hint)
                self._is_misplaced = True
                return

    def _is_inside(self, port: str) -> bool:
        return port.startswith(f"{self.path}.")


def detours(graph: ModelGraph, aspects: Iterable[WovenAspect]) -> list[Detour]:
    """The paths of tokens through aspects that are models, as far as tokens may follow them within the tag.

    When an aspect is inactive, tokens bypass it: its detours are added to the connections and never replace them.  So a
    model that is valid with such an aspect is valid without it.
    """
    at: dict[str, list[tuple[WovenAspect, AspectModel]]] = {}
    responses: dict[str, WovenAspect] = {}
    for woven in aspects:
        if (model := woven.model) is not None and model.requests:
            responses[model.response] = woven
            for place in model.requests:
                at.setdefault(place, []).append((woven, model))
    found: dict[tuple[str, str, str], Detour] = {}

    def lead(sources: list[str], place: str) -> list[str]:
        """Through the aspects at a place; the ports from which tokens may come then."""
        for woven, model in at.get(place, ()):
            for source in sources:
                add(source, model.requests[place], woven)
            sources = [*sources, model.response]
        return sources

    def add(source: str, destination: str, woven: WovenAspect) -> None:
        position = graph.positions.get(f"aspect {woven.name}")
        order = graph.next_order + len(found)
        key = (source, destination, woven.name)
        waits = woven.model is not None and graph.is_strict(woven.model.path)
        found.setdefault(key, Detour(source, destination, None, position, order, woven.name, waits))

    for place in (place for place in at if place in graph.actors):  # what it requests comes in after its turn
        actor = graph.actors[place]
        for woven, model in at[place]:
            for port in (*actor.inputs.values(), *actor.outputs.values()):
                add(port.path, model.requests[place], woven)
    senders: dict[str, list[str]] = {}
    for path in graph.ports if at else ():
        if graph.direction(path) == "output" and graph.is_end(path):
            senders[path] = lead([path], path)  # an aspect at an output acts before the send
    for hop in chain.from_iterable(map(graph.outgoing, graph.ports)) if at else ():
        sources = senders.get(hop.source, [hop.source]) if hop.delay is None else []
        sources = lead(sources, _place(hop.source, hop.destination))
        if hop.destination not in senders:
            sources = lead(sources, hop.destination)
        for source in sources:
            if source in responses:
                add(source, hop.destination, responses[source])
    return list(found.values())


def check_nesting(aspects: Iterable[WovenAspect], graph: ModelGraph, problems: Problems) -> bool:
    """Check that no two aspects attach inside each other: the tokens of both would never leave."""
    models = [(woven, woven.model.path) for woven in aspects if woven.model is not None]
    inside: dict[str, list[str]] = {}
    for woven, _ in models:
        ends = [*woven.ports, *woven.actors, *(end for ends in woven.connections for end in ends)]
        inside[woven.name] = [
            other.name
            for other, path in models
            if woven is not other and any(end.startswith(f"{path}.") for end in ends)
        ]
    loop = find_loop(inside)
    if loop:
        first, second, *_ = loop
        message = f"aspect {first}: it attaches inside {second}, and {second} inside it"
        hint = f"a token would never leave: attach one of them elsewhere, or exclude it: '!{second}.**'"
        problems.add(message, graph.positions.get(f"aspect {first}"), hint)
    return not loop


def _place(source: str, destination: str) -> str:
    return f"{source} -> {destination}"


def _names(ports: Iterable[str]) -> list[str]:
    return [port.rpartition(".")[2] for port in ports]
