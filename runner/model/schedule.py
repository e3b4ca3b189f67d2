"""The firing order: depth in the graph of what must be known first, one director at a time.

A composite with a director of its own is one actor of the graph around it.  Its ports are the ends of two graphs: of
the one outside, in which it fires as a whole when all is there that it needs within the tag, and of the one inside,
which has an order of its own.  So the order of a model is that of the outermost director, with the order of each such
composite put in its place.
"""

from __future__ import annotations

from typing import Any

import networkx as nx

from .graph import Hop, ModelGraph


def firing_order(graph: ModelGraph) -> dict[str, int]:
    """The rank of each actor, and of each port of a composite with a director: lower ranks fire first within a tag.

    Depth as in Ptolemy II: of an input, one more than the outputs that reach it within the tag; of an output, the
    largest of the inputs that it depends on; of an actor, the smallest of its outputs, or the largest of its inputs if
    it has no outputs.  Actors of equal depth rank by priority, those of equal priority in the order of declaration.
    Raises ``networkx.NetworkXUnfeasible`` if there is a loop without delay.
    """
    regions = dependencies(graph)
    order: list[str] = []

    def unfold(director: str) -> None:
        inputs, outputs = graph.borders(director)
        order.extend(inputs)
        for member in _in_order(graph, director, regions[director]):
            if member in graph.clocks:
                unfold(member)
            else:
                order.append(member)
        order.extend(outputs)

    unfold("")
    return {path: rank for rank, path in enumerate(order)}


def dependencies(graph: ModelGraph) -> dict[str, Any]:
    """For each director the directed graph of what must be known first within a tag; its nodes are ports.

    An edge between ports is a connection without delay (``hop``), one within an actor says that the output depends on
    the input within the tag.
    """
    hops: dict[str, list[Hop]] = {director: [] for director in graph.clocks}
    for *_, hop in graph.ports.edges(data="hop"):
        if hop.delay is None:
            hops[graph.director_over(hop)].append(hop)
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


def _in_order(graph: ModelGraph, director: str, region: Any) -> list[str]:
    """The actors of one director in the order in which they fire within a tag."""
    own, _ = graph.borders(director)
    depth: dict[str, int] = {}
    for path in nx.topological_sort(region):
        # Ports of composites without a director are no place to stop at: tokens only pass through them.
        step = int(graph.is_end(path) and graph.direction(path) == "input" and path not in own)
        depth[path] = max((depth[before] + step for before in region.predecessors(path)), default=0)

    def key(member: str) -> tuple[int, int]:
        inputs, outputs = ports_of(graph, member)
        deep = min(map(depth.__getitem__, outputs)) if outputs else max(map(depth.__getitem__, inputs), default=0)
        return deep, graph.priorities.get(member, 0)

    return sorted(graph.members[director], key=key)  # which is stable: the order of declaration decides ties
