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

from epicycle.actors import Place

from .digraph import in_order
from .model_graph import Hop, ModelGraph

# The dependencies within a tag, of one director: the successors of each port.  There is a connection without delay
# between them (``Hop``), or they are in one actor and the second depends on the first within the tag.
Region: TypeAlias = dict[str, dict[str, Hop | None]]


def firing_order(graph: ModelGraph) -> dict[str, int]:
    """The rank of each actor, of each of its inputs, and of each port of a composite with a director.

    Within a tag lower ranks come first.  An actor fires at its own rank for a wake-up and at that of an input for a
    token there, which is the same unless it has outputs that do not depend on this input at once.  Ranks go by depth
    (``depths``), at equal depth by priority, then in the order of declaration.  Raises
    ``graphlib.CycleError`` if there is a loop without delay.
    """
    return {path: rank for rank, (paths, _) in enumerate(_unfolded(graph)) for path in paths}


@dataclass(frozen=True)
class Postings:
    """Where ties are resolved as posted: the place of each rank, and the actors that take all waiting tokens.

    For these, whether they also fire when the tokens for their firing have already been taken.
    """

    places: tuple[Place, ...]
    actors: dict[str, bool]


def postings(graph: ModelGraph) -> Postings | None:
    """The ``Postings``, if ties are posted anywhere."""
    if not any(rules.are_posted for rules in graph.rules.values()):
        return None
    rules = {path: graph.rules_at(path) for path in graph.actors}
    actors = {path: each.are_ptolemys for path, each in rules.items() if each.are_posted}
    return Postings(tuple(place for _, place in _unfolded(graph)), actors)


def _unfolded(graph: ModelGraph) -> list[tuple[list[str], Place]]:
    """What fires in the order of ranks: the paths of each rank, and its place among what is posted."""
    regions = dependencies(graph)
    numbers = {director: number for number, director in enumerate(graph.clocks)}
    order: list[tuple[list[str], Place]] = []

    def unfold(director: str, around: Place) -> None:
        inputs, outputs = graph.borders(director)
        group = 0

        def add(paths: list[str], *, beside: bool = False) -> None:
            nonlocal group
            group += not beside
            if paths[0] in graph.clocks and paths[0] != director:
                unfold(paths[0], (*around, (group, numbers[paths[0]])))
            else:
                order.append((paths, (*around, (group, 0))))

        for port in inputs:
            add([port])
        if director in graph.modal:  # its conductor is first, and its machine last
            add([director])
        for paths, is_tied in _turns(graph, director, depths(graph, director, regions[director])):
            add(paths, beside=is_tied and graph.rules[director].are_posted)
        for port in outputs:
            add([port])
        if graph.refires(director):
            add([graph.end_of(director)])

    unfold("", ())
    return order


def dependencies(graph: ModelGraph) -> dict[str, Region]:
    """The dependencies within a tag under each director."""
    hops: dict[str, list[Hop]] = {director: [] for director in graph.clocks}
    for hop in graph.hops:
        if hop.delay is None:
            hops[graph.director_over(hop)].append(hop)
    for detour in graph.detours:
        if detour.waits:
            continue
        hops[graph.director_over(detour)].append(detour)
    regions: dict[str, Region] = {}
    for director in reversed(graph.clocks):  # inner ones first: the outer ones need to know what depends on what
        region = regions[director] = {}
        for hop in sorted(hops[director], key=lambda hop: hop.order, reverse=True):  # of parallel ones, the first
            region.setdefault(hop.source, {})[hop.destination] = hop
            region.setdefault(hop.destination, {})
        for port in chain(*graph.borders(director)):
            region.setdefault(port, {})
        for member in graph.members[director]:
            inputs, outputs = ports_of(graph, member)
            for port in (*inputs, *outputs):
                region.setdefault(port, {})
            if member in graph.clocks:
                for port in inputs:
                    if graph.rules[member].are_ptolemys or _acts(graph, member, regions[member], port):
                        region[port].update(dict.fromkeys(outputs))
                continue
            for output in graph.actors[member].outputs.values():
                names = graph.actors[member].inputs if output.depends_on is None else output.depends_on
                for name in names:
                    region[f"{member}.{name}"][output.path] = None
    return regions


def ports_of(graph: ModelGraph, member: str) -> tuple[list[str], list[str]]:
    """The paths of the inputs and outputs of an actor, or of a composite that fires as one."""
    if member in graph.clocks:
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
            elif far in borders or region[far] or not ports_of(graph, graph.owner(far))[1]:
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
    for member in graph.members[director]:
        inputs, outputs = ports_of(graph, member)
        deep = min(depth[port] for port in outputs) if outputs else max((depth[port] for port in inputs), default=0)
        free = max((depth[port] for port in inputs if not region[port]), default=deep)
        for port in inputs:
            result[port] = min((depth[output] for output in region[port]), default=max(deep, free))
        result[member] = deep
    return result


def _turns(graph: ModelGraph, director: str, depth: dict[str, int]) -> Iterator[tuple[list[str], bool]]:
    """The firings within a tag in their order: each a composite, or an actor and those of its inputs that go with it.

    If an actor takes the tokens of some inputs later than it answers wake-ups, these inputs are a separate turn.  Each
    turn states whether it is tied with the one before.
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
    before: tuple[int, int] | None = None
    for deep, priority, paths in sorted(turns, key=lambda turn: turn[:2]):
        yield paths, (deep, priority) == before
        before = deep, priority
    if modal is not None:
        yield [modal.machine, *ports_of(graph, modal.machine)[0]], False
