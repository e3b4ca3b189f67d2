"""What must hold of a whole model before it runs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

from epicycle.actors import InputPort, accepts, counted, paths, type_name

from ..graph.digraph import find_loop, in_order
from ..graph.model_graph import ModelGraph
from ..graph.nodes import Detour, Edge
from ..graph.ranks import Region, dependencies
from ..text.kinds import CONNECTION, DIRECTOR, IDLE, LOOP, PORT_TYPE, SIZE, UNCONNECTED
from ..text.limits import RAISE_IT
from ..text.patterns import in_general
from ..text.problems import Problems

MAX_PASSAGE = 200  # composite ports in a row
MAX_SHOWN = 10  # names in one message


def check(graph: ModelGraph, problems: Problems, *, whole: bool = True, partial: bool = False) -> None:
    """Report every wiring problem: types, missing connections, two writers, loops without delay.

    If it is the ``whole`` model and nothing is wrong, warn of actors that can never fire.  A ``partial`` model is one
    to which a program will add: no connection is missing yet.
    """
    if not check_passages(graph, problems):
        return
    check_dialects(graph, problems)
    check_types(graph, problems)
    if not partial:
        check_connections(graph, problems)
    check_loops(graph, problems)
    if whole and not partial and not len(problems):
        check_reach(graph, problems)


def check_dialects(graph: ModelGraph, problems: Problems) -> None:
    """Check that no two dialects want different directors: a run has one."""
    wanting = [(path, each.dialect) for path, each in graph.domains.items() if each.dialect.director()]
    for path, each in wanting[1:]:
        first = wanting[0][1]
        if each.director() is not first.director():
            message = f"{path} is like {each.name}, but other parts of the model are like {first.name}"
            hint = "a run has one director, and each of these has its own"
            problems.add(message, graph.position_of(path), hint, kind=DIRECTOR)
            return


def check_passages(graph: ModelGraph, problems: Problems) -> bool:
    """Check that paths through composite ports end, and are few enough to be followed one by one."""
    ports = graph.ports
    between = {
        path: [edge.destination for edge in graph.outgoing(path) if ports[edge.destination].port is None]
        for path, node in ports.items()
        if node.port is None
    }
    if cycle := find_loop(between):
        edge = next(edge for edge in graph.outgoing(cycle[-1]) if edge.destination == cycle[0])
        message = f"a loop of composite ports with no actor in it: {' -> '.join([*cycle, cycle[0]])}"
        hint = "a composite that passes its input straight to its output cannot be connected to itself"
        problems.add(message, edge.position, hint, kind=LOOP)
        return False
    # The number of wires that lead on from each port, without following them: there may be very many.
    onward: dict[str, int] = {}
    last: dict[str, tuple[int, str]] = {}  # how many composite ports follow each in a row, and the last of them
    for path in reversed(in_order(between)):
        onward[path] = sum(onward.get(edge.destination, 1) for edge in graph.outgoing(path))
        last[path] = max(((last[far][0] + 1, last[far][1]) for far in between[path]), default=(0, path))
    first = max(last, key=last.__getitem__, default="")
    if first and last[first][0] > MAX_PASSAGE:
        what = f"a path through more than {MAX_PASSAGE} composite ports"
        problems.add(f"{what}, from {first} to {last[first][1]}", kind=SIZE)
        return False
    wires = 0
    for actor in graph.actors.values():
        for port in actor.outputs.values():
            wires += sum(onward.get(edge.destination, 1) for edge in graph.outgoing(port.path))
            limit = graph.limits.wires
            if wires > limit:
                message, at = f"the model has more than {limit:,} wires", graph.position_of(actor.path)
                problems.add(message, at, RAISE_IT, kind=SIZE)
                return False
    return True


def check_types(graph: ModelGraph, problems: Problems) -> None:
    """Check that the next port with a type takes what each port sends or passes on."""
    for path in graph.ports:
        given = graph.type_of(path)
        if given is None:
            continue
        for edges in _stretches(graph, path):
            far = edges[-1].destination
            wanted = graph.type_of(far)
            if accepts(wanted, given):
                continue
            way = " -> ".join([path, *(edge.destination for edge in edges)])
            first, last = edges[0].position, edges[-1].position
            verb = "sends" if graph.ports[path].port is not None else "passes on"
            problems.add(
                f"{path} {verb} {type_name(given)}, but {far} takes {type_name(wanted)}",
                first,
                *(who for who in (_who(graph, path), _who(graph, far)) if who),
                *((f"the path: {way}",) if len(edges) > 1 else ()),
                *((f"connected onward at {last}",) if first and last and first != last else ()),
                about=("types", in_general(path), in_general(far)),
                kind=PORT_TYPE,
            )


def _stretches(graph: ModelGraph, path: str) -> Iterator[tuple[Edge, ...]]:
    """The paths from a port to the next ports that have a type."""
    for edge in graph.outgoing(path):
        if graph.type_of(edge.destination) is not None:
            yield (edge,)
        else:
            for rest in _stretches(graph, edge.destination):
                yield (edge, *rest)


def _who(graph: ModelGraph, port: str) -> str:
    """Whose port it is, and where that is declared."""
    owner = paths.parent(port)
    if owner in graph.actors:
        what, at = f"{owner} is a {type(graph.actors[owner]).__name__}", graph.position_of(owner)
    else:
        what, at = f"{port} is a port of {graph.components[owner].kind}", graph.ports[port].declared
    return f"{what}, declared at {at}" if at is not None else ""


def check_connections(graph: ModelGraph, problems: Problems) -> None:
    """Check that required inputs are connected, and that single inputs have one writer."""
    for actor in graph.actors.values():
        position = graph.position_of(actor.path)
        for port in actor.inputs.values():
            wires = graph.wires_to(port)
            if not wires and port.required and not _may_be_connected(graph, port.path):
                problems.add(
                    f"{port.path} is not connected, but {type(actor).__name__} needs it",
                    position,
                    *_open_end(graph, port.path),
                    f"it takes {type_name(port.type)}" + (f": {port.doc}" if port.doc else ""),
                    about=("missing", in_general(port.path)),
                    kind=UNCONNECTED,
                )
            if len(wires) > 1 and not port.multi and len(graph.channels_to(port)) > 1:
                times = Counter(wire.source.path for wire in wires)
                writers = ", ".join(
                    f"{path} ({number} times)" if number > 1 else path for path, number in times.items()
                )
                first = wires[0].edges[-1].position
                what = f"{counted(len(times), 'sender')} write{'s' if len(times) == 1 else ''}"
                problems.add(
                    f"{port.path} takes one connection, but {what} to it: {writers}",
                    wires[1].edges[-1].position,
                    *((f"the first connection is at {first}",) if first else ()),
                    "connect only one of them, or send through an actor that merges them",
                    "if they form one channel, write {from: [...], to: ..., shared: true}",
                    about=("several", in_general(port.path)),
                    kind=CONNECTION,
                )


def _may_be_connected(graph: ModelGraph, path: str) -> bool:
    """Whether a missing connection may be due to another problem: a wrong connection, or a missing actor."""
    known, before = {path}, [path] if graph.fed else []
    while before:
        sources = {edge.source for edge in graph.incoming(before.pop())} - known
        known |= sources
        before += sources
    return graph.may_be_fed(known)


def _open_end(graph: ModelGraph, path: str) -> tuple[str, ...]:
    """Where a chain of composite ports that leads to an unconnected input begins."""
    end = path
    while incoming := graph.incoming(end):
        end = incoming[0].source
    return (f"nothing is connected to {end}, which leads to it",) if end != path else ()


def check_loops(graph: ModelGraph, problems: Problems) -> None:
    """Check that every loop has a delay somewhere; otherwise there is no firing order within a tag."""
    for region in dependencies(graph).values():
        if not find_loop(region):
            continue
        import networkx as nx  # here, because it takes long and most models have no such loop

        declared = {path: place for place, path in enumerate(graph.ports)}
        for component in nx.strongly_connected_components(nx.from_dict_of_lists(region, nx.DiGraph)):
            if len(component) > 1:
                # A graph in the order of declaration: a view would follow the order of a set, which varies between
                # runs.
                inner = nx.DiGraph()
                for path in sorted(component, key=declared.__getitem__):
                    inner.add_edges_from((path, far) for far in region[path] if far in component)
                _add_loop(graph, _shortest_loop(graph, inner, region), problems)


def _shortest_loop(graph: ModelGraph, inner: Any, region: Region) -> list[list[Edge]]:
    """The paths from actor to actor around a loop, from the first actor of a strongly connected graph back to it."""
    import networkx as nx

    start = next(path for path in inner if graph.is_end(path))
    loop = [start, *min((nx.shortest_path(inner, after, start) for after in inner.successors(start)), key=len)]
    ways: list[list[Edge]] = []
    for source, destination in pairwise(loop):
        edge = region[source][destination]
        if edge is not None:
            if graph.is_end(edge.source):
                ways.append([])
            ways[-1].append(edge)
    return ways


def _add_loop(graph: ModelGraph, ways: list[list[Edge]], problems: Problems) -> None:
    actors = [paths.parent(way[0].source) for way in ways]
    blamed: Edge | None = next((edge for way in ways for edge in way if isinstance(edge, Detour)), None)
    if isinstance(blamed, Detour):
        fewer = "attach it to fewer of them, or give that model a delay"
        hints = [f"the aspect {blamed.aspect} sends the tokens of all its ports through one model: {fewer}"]
    else:
        # The loop begins with the actor that is declared first, so its last path is the one that leads back.  On that
        # path, the delay belongs to the outermost connection: a composite may be right where it is used elsewhere.
        blamed = min(ways[-1], key=lambda edge: (_scope(graph, edge).count("."), edge.order))
        hints = [
            f"{path} has a director like {graph.domains[path].dialect.name}: all its outputs depend on all its inputs"
            if graph.domains[path].dialect.is_strict
            else f"{path} has its own director: it fires as one actor, when all inputs that act in the tag have come"
            for path in dict.fromkeys(actors)
            if path in graph.domains
        ]
        best = _with_delay(graph, blamed)
        hints.append(f"give one of these connections a delay, preferably the one that leads back: {best}")
    loop = " -> ".join([*actors, actors[0]])
    about = ("loop", *map(in_general, actors))
    message = f"a loop without delay: {loop}"
    problems.add(message, blamed.position, *map(_step, ways), *hints, about=about, kind=LOOP)


def _step(way: list[Edge]) -> str:
    ports = [way[0].source, *(edge.destination for edge in way)]
    places = [f"{edge.position.file}:{edge.position.line}" for edge in way if edge.position is not None]
    return " -> ".join(ports) + (f" ({', '.join(dict.fromkeys(places))})" if places else "")


def _scope(graph: ModelGraph, edge: Edge) -> str:
    """The path of the composite inside which a connection is made, with a dot after each name."""
    owner = paths.parent(edge.source)
    # Tokens from an input come from the composite's own port, others from a port of one of its actors.
    scope = owner if graph.direction(edge.source) == "input" else paths.parent(owner)
    return f"{scope}." if scope else ""


def _with_delay(graph: ModelGraph, edge: Edge) -> str:
    scope = _scope(graph, edge)
    ends = [end.removeprefix(scope) for end in (edge.source, edge.destination)]
    source, destination = (f'"{end}"' if "[" in end else end for end in ends)
    return f"{{from: {source}, to: {destination}, delay: ...}}"


def check_reach(graph: ModelGraph, problems: Problems) -> None:
    """Warn of actors that can never fire because no source leads to them."""
    alive: set[str] = set()
    detours: dict[str, list[str]] = {}
    for detour in graph.detours:
        detours.setdefault(detour.source, []).append(detour.destination)
    waiting = [port.path for actor in graph.actors.values() if actor.is_source for port in actor.outputs.values()]
    while waiting:
        path = waiting.pop()
        if path in alive:
            continue
        alive.add(path)
        waiting += [*(edge.destination for edge in graph.outgoing(path)), *detours.get(path, ())]
        port = graph.ports[path].port
        if isinstance(port, InputPort):
            waiting += [output.path for output in port.actor.outputs.values()]
    never = [
        actor.path
        for actor in graph.actors.values()
        if not actor.is_source and not any(port.path in alive for port in actor.inputs.values())
    ]
    if not never:
        return
    import networkx as nx

    idle: Any = nx.DiGraph()
    idle.add_nodes_from(never)
    for wire in graph.wires():
        if wire.destination.actor.path in idle:
            idle.add_edge(wire.source.actor.path, wire.destination.actor.path)
    groups = nx.condensation(idle)
    order = {path: place for place, path in enumerate(idle)}
    for group in groups:
        if groups.in_degree(group):
            continue  # reported with what precedes it
        first, *others = sorted(groups.nodes[group]["members"], key=order.__getitem__)
        behind = {path for after in nx.descendants(groups, group) for path in groups.nodes[after]["members"]}
        in_loop = others or idle.has_edge(first, first)
        why = f"only the loop {_some([first, *others])} feeds it" if in_loop else "nothing feeds it"
        problems.warn(
            f"{first} can never fire: it is not a source, and {why}",
            graph.position_of(first),
            *((f"nor can the actors that it feeds: {_some(sorted(behind, key=order.__getitem__))}",) if behind else ()),
            about=("idle", in_general(first)),
            kind=IDLE,
        )


def _some(paths: list[str]) -> str:
    return ", ".join(paths[:MAX_SHOWN]) + (f" and {len(paths) - MAX_SHOWN} more" if len(paths) > MAX_SHOWN else "")
