"""Aspects that are models: a composite class that is woven around ports and becomes part of the graph.

Tokens come in by a *request port*, an input of the composite, and continue when they leave by its *response port*: the
output ``response``, or its only output.  If there are several inputs, a pointcut may name the one that takes its tokens
(``request: in2``); the default is the input ``request``, or the only input.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import chain

from epicycle.actors import OutputPort, accepts, declared_parameters, paths, type_name
from epicycle.aspects import Aspect, CompositeAspect, FiringTime, Request

from ..graph.acts import connection_place
from ..graph.digraph import find_loop
from ..graph.model_graph import ModelGraph
from ..graph.nodes import Detour
from ..graph.woven import AspectModel, Places, WovenAspect
from ..language.parts import PartText, beside
from ..language.places import PointcutText
from ..text.faults import place_in
from ..text.problems import POISON, Poison, Position, Problems
from .paths import PlaceOf, without_port
from .weave import Aimed, Pointcuts

BY_PLACE = "or name the input that takes the tokens: {at: ..., request: ...}"
OWN = frozenset(declared_parameters(CompositeAspect))  # when it acts: these are not parameters of the composite


def as_actor(part: PartText) -> PartText:
    """The composite in an aspect's declaration, as it would be declared among the actors."""
    values = {name: entry for name, entry in part.values.items() if name not in OWN}
    priority = beside("priority", values.pop("priority").value) if "priority" in values else None
    return replace(part, values=values, priority=priority)


def weave_model(
    pointcuts: Pointcuts,
    aspect: Aspect | Poison,
    at: Sequence[PointcutText | Poison],
    place_of: PlaceOf,
    position: Position,
) -> WovenAspect | Poison:
    """Attach an aspect that is a composite: what comes to its places is handed to it, and goes on when it answers."""
    graph = pointcuts.graph
    places, aimed = pointcuts.resolve(at)
    included = [each for each in at if each and not each.exclude]
    requests, response, model = _planned(pointcuts, included, places, aimed, position)
    if POISON in requests or aspect is POISON:
        graph.leave_open(pointcuts.own)
    if aspect is POISON:
        return POISON
    woven = pointcuts.bind(aspect, places, place_of, position)
    for port in (each for each in requests if each):
        for edge in list(graph.incoming(port)):  # a problem that has been reported
            graph.disconnect(edge)
        graph.open_requests(port)
    if response:
        graph.ports[response].type = Request
    return replace(woven, model=model) if model else woven


def _planned(
    view: Pointcuts, pointcuts: Sequence[PointcutText], places: Places, aimed: Aimed, position: Position
) -> tuple[list[str | Poison], str | Poison, AspectModel | Poison]:
    """By which ports tokens of the places come in, by which they leave, and both with the composite."""
    graph, path = view.graph, view.own
    inputs, outputs = graph.borders(path)
    of_each = [_request(view, inputs, each) for each in pointcuts or [PointcutText("", position)]]
    requests = list(dict.fromkeys(of_each))
    response = _only(view, outputs, "response", "output", position)
    for port in (each for each in requests if each):
        for edge in graph.incoming(port):
            message = f"{port} takes the tokens of this aspect, so nothing else can be connected to it"
            view.tell(message, edge.position, "add another input for other tokens")
        if isinstance(graph.ports[port].port, OutputPort):
            hint = "attach that aspect here, too, or add another composite"
            view.tell(f"{path} is already the model of another aspect", position, hint)
    _check_types(view, [each for each in (*requests, response) if each])
    asked: dict[str, str] = {}
    times: dict[str, FiringTime] = {}
    for pointcut, request in zip(pointcuts, of_each, strict=False):
        here = [place for place in places.places if aimed[place] is pointcut]
        asked |= {place: request for place in here if request}
        times |= {place: pointcut.firing_time for place in here if place in places.actors}
        for fault in without_port("time", pointcut.firing_time, [each for each in here if each in graph.actors], graph):
            where = pointcut.position if pointcut.time is None else place_in(pointcut.time.node, fault)
            view.tell(fault.message, where, *fault.help)
    is_placed = _is_under_one_director(view, places, position)
    if not response or not is_placed:
        return requests, response, POISON
    asked = {place: asked[place] for place in places.places if place in asked}
    return requests, response, AspectModel(path, view.kind, response, asked, times)


def _request(view: Pointcuts, inputs: list[str], pointcut: PointcutText) -> str | Poison:
    """The port by which the tokens of a pointcut come in."""
    asked = pointcut.request
    if asked is None:
        return _only(view, inputs, "request", "input", pointcut.position, BY_PLACE)
    found = f"{view.own}.{asked.text}"
    if found in inputs:
        return found
    names = [*map(paths.name, inputs)]
    hint = f"its inputs: {', '.join(names) or 'none'}"
    return view.tell(f"{view.kind} has no input {asked.text!r}", asked, hint, near=(asked.text, names))


def _only(
    view: Pointcuts, ports: list[str], name: str, direction: str, position: Position, hint: str = ""
) -> str | Poison:
    """The port of that name, or the only one of its direction."""
    named, kind = f"{view.own}.{name}", view.kind
    if named in ports or len(ports) == 1:
        return named if named in ports else ports[0]
    if not ports:
        return view.tell(f"{kind} has no {direction}", position, f"add '{direction}s: [{name}]' to {kind}")
    message = f"{kind} has {len(ports)} {direction}s, none of them called {name!r}"
    known = f"its {direction}s: {', '.join(map(paths.name, ports))}"
    return view.tell(message, position, known, f"call one of them {name!r}" + (f", {hint}" if hint else ""))


def _check_types(view: Pointcuts, ports: Iterable[str]) -> None:
    """Check that the ports take and give requests, if they declare types."""
    for port in ports:
        node = view.graph.ports[port]
        if node.type is not None and not accepts(node.type, Request):
            what = f"{port.rpartition('.')[2]} of {view.kind} has the type {type_name(node.type)}"
            hint = "leave out its type: the actors inside receive requests, which contain the tokens"
            view.tell(f"{what}, but aspects pass requests", node.declared, hint)


def _is_under_one_director(view: Pointcuts, places: Places, position: Position) -> bool:
    """Whether all places are under the composite's own director, which has one order and one time for them."""
    graph, own = view.graph, view.graph.director_of(view.own)
    found = {port: graph.director_of(paths.parent(port)) for port in places.ports}
    found |= {actor: graph.director_of(actor) for actor in places.actors}
    for source, destination in places.connections:
        edge = next(edge for edge in graph.outgoing(source) if edge.destination == destination)
        found[connection_place(source, destination)] = graph.director_over(edge)
    for place, director in found.items():
        if director != own:
            where, hint = f"outside {own}", f"declare it outside {own}"
            if director:
                where = f"inside {director}"
                hint = f"declare it inside {director}, or attach it to the ports of {director}"
            view.tell(f"{place} is {where}, which has its own director", position, hint)
            return False
    return True


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
        order = graph.next_order + len(found)
        key = (source, destination, woven.name)
        waits = woven.model is not None and graph.is_strict(woven.model.path)
        found.setdefault(key, Detour(source, destination, None, woven.position, order, woven.name, waits))

    for place in (place for place in at if place in graph.actors):  # what it requests comes in after its turn
        actor = graph.actors[place]
        for woven, model in at[place]:
            for port in (*actor.inputs.values(), *actor.outputs.values()):
                add(port.path, model.requests[place], woven)
    senders: dict[str, list[str]] = {}
    for path in graph.ports if at else ():
        if graph.direction(path) == "output" and graph.is_end(path):
            senders[path] = lead([path], path)  # an aspect at an output acts before the send
    for edge in chain.from_iterable(map(graph.outgoing, graph.ports)) if at else ():
        sources = senders.get(edge.source, [edge.source]) if edge.delay is None else []
        sources = lead(sources, connection_place(edge.source, edge.destination))
        if edge.destination not in senders:
            sources = lead(sources, edge.destination)
        for source in sources:
            if source in responses:
                add(source, edge.destination, responses[source])
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
        problems.add(message, next(woven.position for woven, _ in models if woven.name == first), hint)
    return not loop
