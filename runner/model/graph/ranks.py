"""The firing order: depth in the graph of dependencies within a tag, one director at a time.

A composite with its own director is one actor of the graph around it.  Its ports are the ends of two graphs: the one
outside, in which it fires as a whole when everything that it needs within the tag is there, and the one inside, which
has its own order.  The order of a model is that of the outermost director, with the order of each such composite
inserted at its place.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from typing import TypeAlias

from epicycle.actors import paths

from .digraph import in_order
from .model_graph import ModelGraph
from .nodes import Edge

# The dependencies within a tag, of one director: the successors of each port.  There is a connection without delay
# between them (``Edge``), or they are in one actor and the second depends on the first within the tag.
Region: TypeAlias = dict[str, dict[str, Edge | None]]


@dataclass(frozen=True)
class Step:
    """A turn under a director: of an actor, for its wake-ups or for some of its inputs; of a port; or of a composite.

    Actors and composites have a ``level``, their depth and priority: at equal ones, nothing else decides who is first.
    """

    paths: list[str]
    level: tuple[int, int] | None = None


def firing_order(graph: ModelGraph) -> dict[str, int]:
    """The rank of each actor, of each of its inputs, and of each port of a composite with a director.

    Within a tag lower ranks come first.  An actor fires at its own rank for a wake-up and at that of an input for a
    token there, which is the same unless it has outputs that do not depend on this input at once.  Ranks go by depth
    (``depths``), at equal depth by priority, then in the order of declaration.  Raises
    ``graphlib.CycleError`` if there is a loop without delay.
    """
    order, found = steps(graph), dict[str, int]()

    def unfold(director: str, rank: int) -> int:
        for step in order[director]:
            if step.paths[0] in order and step.paths[0] != director:
                rank = unfold(step.paths[0], rank)
            else:
                found.update(dict.fromkeys(step.paths, rank))
                rank += 1
        return rank

    unfold("", 0)
    return found


def steps(graph: ModelGraph) -> dict[str, list[Step]]:
    """What each director lets happen, in order; what is in a composite with its own happens at its step."""
    found = {}
    for director, region in dependencies(graph).items():
        inputs, outputs = graph.borders(director)
        found[director] = [
            *(Step([port]) for port in inputs),
            # Of a composite with modes, the conductor is first, and the machine last.
            *([Step([director])] if graph.domains[director].machine else ()),
            *_turns(graph, director, depths(graph, director, region)),
            *(Step([port]) for port in outputs),
            *([Step([graph.end_of(director)])] if graph.is_strict(director) else ()),
        ]
    return found


def dependencies(graph: ModelGraph) -> dict[str, Region]:
    """The dependencies within a tag under each director."""
    edges: dict[str, list[Edge]] = {director: [] for director in graph.domains}
    for edge in graph.edges:
        if edge.delay is None:
            edges[graph.director_over(edge)].append(edge)
    for detour in graph.detours:
        if detour.waits:
            continue
        edges[graph.director_over(detour)].append(detour)
    regions: dict[str, Region] = {}
    for director in reversed(graph.domains):  # inner ones first: the outer ones need to know what depends on what
        region = regions[director] = {}
        for edge in sorted(edges[director], key=lambda edge: edge.order, reverse=True):  # of parallel ones, the first
            region.setdefault(edge.source, {})[edge.destination] = edge
            region.setdefault(edge.destination, {})
        for port in chain(*graph.borders(director)):
            region.setdefault(port, {})
        for member in graph.domains[director].members:
            inputs, outputs = ports_of(graph, member)
            for port in (*inputs, *outputs):
                region.setdefault(port, {})
            if member in graph.domains:
                for port in inputs:
                    if graph.domains[member].dialect.is_strict or _acts(graph, member, regions[member], port):
                        region[port].update(dict.fromkeys(outputs))
                continue
            for output in graph.actors[member].outputs.values():
                names = graph.actors[member].inputs if output.depends_on is None else output.depends_on
                for name in names:
                    region[f"{member}.{name}"][output.path] = None
    return regions


def ports_of(graph: ModelGraph, member: str) -> tuple[list[str], list[str]]:
    """The paths of the inputs and outputs of an actor, or of a composite that fires as one."""
    if member in graph.domains:
        return graph.borders(member)
    actor = graph.actors[member]
    return [port.path for port in actor.inputs.values()], [port.path for port in actor.outputs.values()]


def _acts(graph: ModelGraph, director: str, region: Region, port: str) -> bool:
    """Whether a token at an input of a composite has an effect within the tag.

    If so, the composite must wait for it, or some of the actors inside would fire with only a part of their tokens; so
    everything it sends depends on it.  If not, the token only reaches actors that send it, or a result of it, later.
    """
    _, borders = graph.borders(director)
    waiting, seen = [port], {port}
    while waiting:
        for far in region[waiting.pop()].keys() - seen:
            if not graph.is_end(far):
                waiting.append(far)
            elif far in borders or region[far] or not ports_of(graph, paths.parent(far))[1]:
                return True
            seen.add(far)
    return False


def depths(graph: ModelGraph, director: str, region: Region) -> dict[str, int]:
    """The depth of each port and actor of one director, as in Ptolemy II.

    An output is as deep as the inputs that it depends on within the tag, and an input one deeper than the outputs that
    reach it; an actor is as deep as its shallowest output, or its deepest input if it has no outputs.  Tokens of an
    input are taken at the depth of the first output that depends on it, so that everything that belongs to them is
    there; those of the inputs on which no output depends at once are taken together, at the depth of the deepest.
    """
    own, _ = graph.borders(director)
    depth: dict[str, int] = {}
    for path in in_order(region):
        # Ports of composites without a director have no depth: tokens only pass through them.
        if path in depth and graph.is_end(path) and graph.direction(path) == "input" and path not in own:
            depth[path] += 1
        deep = depth.setdefault(path, 0)
        for far in region[path]:
            depth[far] = max(depth.get(far, 0), deep)
    result = dict(depth)
    for member in graph.domains[director].members:
        inputs, outputs = ports_of(graph, member)
        deep = min(depth[port] for port in outputs) if outputs else max((depth[port] for port in inputs), default=0)
        free = max((depth[port] for port in inputs if not region[port]), default=deep)
        for port in inputs:
            result[port] = min((depth[output] for output in region[port]), default=max(deep, free))
        result[member] = deep
    return result


def _turns(graph: ModelGraph, director: str, depth: dict[str, int]) -> Iterator[Step]:
    """The firings within a tag in their order: each a composite, or an actor and those of its inputs that go with it.

    If an actor takes the tokens of some inputs later than it answers wake-ups, these inputs are a separate turn.
    """
    turns: list[tuple[tuple[int, int], list[str]]] = []
    machine = graph.domains[director].machine
    for member in graph.domains[director].members:
        if member == machine:
            continue
        inputs = [] if member in graph.domains else ports_of(graph, member)[0]
        found: dict[int, list[str]] = {depth[member]: [member]}
        for port in inputs:
            found.setdefault(depth[port], []).append(port)
        turns += [((deep, graph.components[member].priority), paths) for deep, paths in found.items()]
    # The sort is stable: the order of declaration decides ties.
    for level, fired in sorted(turns, key=lambda turn: turn[0]):
        yield Step(fired, level)
    if machine:
        yield Step([machine, *ports_of(graph, machine)[0]])
