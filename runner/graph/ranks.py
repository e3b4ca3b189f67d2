"""The firing order: depth in the graph of what must be known first, one director at a time.

A composite with a director of its own is one actor of the graph around it.  Its ports are the ends of two graphs: of
the one outside, in which it fires as a whole when all is there that it needs within the tag, and of the one inside,
which has an order of its own.  So the order of a model is that of the outermost director, with the order of each such
composite put in its place.
"""

from __future__ import annotations

from typing import Any

import networkx as nx

from .model_graph import Hop, ModelGraph


def firing_order(graph: ModelGraph) -> dict[str, int]:
    """The rank of each actor, of each of its inputs, and of each port of a composite with a director.

    Within a tag lower ranks come first.  An actor fires at its own rank for a wake-up and at that of an input for a
    token there, which is the same unless it has outputs that do not depend on this input at once.  Ranks go by depth
    (``depths``), at equal depth by priority, then in the order of declaration.  Raises
    ``networkx.NetworkXUnfeasible`` if there is a loop without delay.
    """
    regions = dependencies(graph)
    order: list[list[str]] = []

    def unfold(director: str) -> None:
        inputs, outputs = graph.borders(director)
        order.extend([port] for port in inputs)
        modal = graph.modal.get(director)
        if modal is not None:  # its conductor is first, and its machine last
            order.append([director])
        for turn in _turns(graph, director, depths(graph, director, regions[director])):
            if turn[0] in graph.clocks:
                unfold(turn[0])
            else:
                order.append(turn)
        order.extend([port] for port in outputs)

    unfold("")
    return {path: rank for rank, paths in enumerate(order) for path in paths}


def dependencies(graph: ModelGraph) -> dict[str, Any]:
    """For each director the directed graph of what must be known first within a tag; its nodes are ports.

    An edge between ports is a connection without delay (``hop``), one within an actor says that the output depends on
    the input within the tag.
    """
    hops: dict[str, list[Hop]] = {director: [] for director in graph.clocks}
    for *_, hop in graph.ports.edges(data="hop"):
        if hop.delay is None:
            hops[graph.director_over(hop)].append(hop)
    for detour in graph.detours:
        hops[graph.director_over(detour)].append(detour)
    regions: dict[str, Any] = {}
    for director in reversed(graph.clocks):  # inner ones first: the outer ones need to know what depends on what
        region = regions[director] = nx.DiGraph()
        for hop in sorted(hops[director], key=lambda hop: hop.order, reverse=True):  # of parallel ones, the first
            region.add_edge(hop.source, hop.destination, hop=hop)
        inputs, outputs = graph.borders(director)
        region.add_nodes_from((*inputs, *outputs))
        for member in graph.members[director]:
            inputs, outputs = ports_of(graph, member)
            region.add_nodes_from((*inputs, *outputs))
            if member in graph.clocks:
                acting = [port for port in inputs if _acts(graph, member, regions[member], port)]
                region.add_edges_from((port, output) for port in acting for output in outputs)
                continue
            for output in graph.actors[member].outputs.values():
                names = graph.actors[member].inputs if output.depends_on is None else output.depends_on
                region.add_edges_from((f"{member}.{name}", output.path) for name in names)
    return regions


def ports_of(graph: ModelGraph, member: str) -> tuple[list[str], list[str]]:
    """The paths of the inputs and outputs of an actor, or of a composite that fires as one."""
    if member in graph.clocks:
        return graph.borders(member)
    actor = graph.actors[member]
    return [port.path for port in actor.inputs.values()], [port.path for port in actor.outputs.values()]


def _acts(graph: ModelGraph, director: str, region: Any, port: str) -> bool:
    """Whether what enters a composite by a port makes a difference within the tag.

    If so, the composite can do nothing before it is there, or some of the actors inside would fire with a part of
    their tokens; so all that it sends depends on it.  If not, it goes to actors alone that send it, or what comes of
    it, later.
    """
    _, borders = graph.borders(director)
    ends = (far for _, far in nx.edge_bfs(region, port) if graph.is_end(far))
    return any(far in borders or region.out_degree(far) or not ports_of(graph, graph.owner(far))[1] for far in ends)


def depths(graph: ModelGraph, director: str, region: Any) -> dict[str, int]:
    """The depth of each port and actor of one director, as in Ptolemy II.

    An output is as deep as the inputs that it depends on within the tag, and an input one deeper than the outputs that
    reach it; an actor is as deep as its shallowest output, or its deepest input if it has no outputs.  Tokens of an
    input are taken at the depth of the first output that depends on it, so that all that belongs to them is there;
    those of the inputs on which no output depends at once are taken together, at the depth of the deepest.
    """
    own, _ = graph.borders(director)
    depth: dict[str, int] = {}
    for path in nx.topological_sort(region):
        # Ports of composites without a director are no place to stop at: tokens only pass through them.
        step = int(graph.is_end(path) and graph.direction(path) == "input" and path not in own)
        depth[path] = max((depth[before] + step for before in region.predecessors(path)), default=0)
    result = dict(depth)
    for member in graph.members[director]:
        inputs, outputs = ports_of(graph, member)
        deep = min(depth[port] for port in outputs) if outputs else max((depth[port] for port in inputs), default=0)
        free = max((depth[port] for port in inputs if not region.out_degree(port)), default=deep)
        for port in inputs:
            result[port] = min((depth[output] for output in region.successors(port)), default=max(deep, free))
        result[member] = deep
    return result


def _turns(graph: ModelGraph, director: str, depth: dict[str, int]) -> list[list[str]]:
    """The firings within a tag in their order: each a composite, or an actor and those of its inputs that go with it.

    If an actor takes the tokens of some inputs later than it answers wake-ups, these inputs are a turn of their own.
    """
    turns: list[tuple[int, int, list[str]]] = []
    modal = graph.modal.get(director)
    for member in graph.members[director]:
        if modal is not None and member == modal.machine:
            continue
        inputs = [] if member in graph.clocks else ports_of(graph, member)[0]
        found: dict[int, list[str]] = {depth[member]: [member]}
        for port in inputs:
            found.setdefault(depth[port], []).append(port)
        turns += [(deep, graph.priorities.get(member, 0), paths) for deep, paths in found.items()]
    # The sort is stable: the order of declaration decides ties.
    order = [paths for _, _, paths in sorted(turns, key=lambda turn: turn[:2])]
    return order if modal is None else [*order, [modal.machine, *ports_of(graph, modal.machine)[0]]]
