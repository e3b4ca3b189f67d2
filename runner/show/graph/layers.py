"""Layers: the column of each box, and the order of the boxes in a column.

The first steps of Sugiyama's method (Sugiyama, Tagawa, Toda 1981) for boxes with ports: break cycles, layer by longest
path, route long nets through the layers between, reduce crossings by barycentres.  A net is a tree from one port to
many; it takes one place in each layer that it passes, regardless of its branches.
"""

from __future__ import annotations

from bisect import bisect_right, insort
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby, product
from operator import itemgetter
from typing import Any, TypeAlias, TypeVar

import networkx as nx

T = TypeVar("T")
SWEEPS, PATIENCE = 12, 3  # how often all layers are ordered, and how often in vain
MOST_PASSES = 400  # in one drawing; the lines of more could not be followed by eye, and take minutes to order


@dataclass(eq=False)
class Pin:
    """Where a net meets a cell, on its left or right side, ``offset`` below its top."""

    cell: Cell
    offset: float = 0.0

    @property
    def y(self) -> float:
        """Its height from the top; valid once its cell is placed."""
        return self.cell.y + self.offset


@dataclass(eq=False)
class Cell:
    """An item in a layer.

    A ``box``; an ``entry`` or ``exit``, which is a port of the surrounding frame; a ``pass``, the place that a net
    takes in a layer; a ``turn``, which only reserves a position where a net turns round.
    """

    kind: str
    left: list[Pin] = field(default_factory=list)
    right: list[Pin] = field(default_factory=list)
    layer: int = 0
    width: float = 0.0
    height: float = 0.0
    x: float = 0.0
    y: float = 0.0

    def pin(self, side: str) -> Pin:
        """Add a pin below the others on that side."""
        made = Pin(self)
        (self.left if side == "left" else self.right).append(made)
        return made


@dataclass(eq=False)
class Net:
    """A tree from a right pin to left pins; a ``label`` takes space in the layer next to the source."""

    source: Pin
    targets: list[Pin]
    label: tuple[float, float] | None = None  # width and height
    labelled: Cell | None = None  # the pass that carries the label
    is_cut: bool = False  # shown by names at its ends, without a line between them


@dataclass(eq=False)
class Run:
    """The part of a net between two layers: the pins that it joins on the left and on the right."""

    net: Net
    left: list[Pin]
    right: list[Pin]


Layers: TypeAlias = list[list[Cell]]  # the cells of each layer from top to bottom
Runs: TypeAlias = list[list[Run]]  # to the right of each layer
Joints: TypeAlias = list[list[tuple[Pin, Pin]]]  # the pairs of pins that runs join


def layer(cells: Sequence[Cell], nets: Sequence[Net]) -> tuple[Layers, Runs]:
    """Assign every cell to a layer, and create the passes of long nets.

    Entries are in the first layer, exits in the last.  Nets that would close a cycle run backwards: those with a label
    (a delay) first, then those declared last.
    """
    graph = _forward(cells, nets)
    for cell in nx.topological_sort(graph):
        least = 0 if cell.kind == "entry" else 1
        cell.layer = max([least, *(before.layer + graph[before][cell]["span"] for before in graph.predecessors(cell))])
    for cell in reversed(list(nx.topological_sort(graph))):  # sources move to where they are needed
        after = [other.layer - graph[cell][other]["span"] for other in graph.successors(cell)]
        if cell.kind == "box" and after and graph.in_degree(cell) < len(after):
            cell.layer = min(after)
    last = max([1, *(cell.layer - (cell.kind == "exit") for cell in cells)])
    for cell in cells:
        if cell.kind == "exit":
            cell.layer = last + 1
    layers: Layers = [[] for _ in range(last + 2)]
    for cell in cells:
        layers[cell.layer].append(cell)
    runs: Runs = [[] for _ in range(last + 1)]
    passes = 0
    for net in sorted(nets, key=_length):
        passes += _length(net) - 1
        ends = (net.source.cell, *(pin.cell for pin in net.targets))
        net.is_cut = passes > MOST_PASSES and all(cell.kind == "box" for cell in ends)
    for net in nets:
        if not net.is_cut:
            _spread(net, layers, runs)
    return layers, runs


def _length(net: Net) -> int:
    """How many layers a net spans."""
    ends = [net.source.cell.layer, *(pin.cell.layer - 1 for pin in net.targets)]
    return max(ends) - min(ends) + 1


def _forward(cells: Sequence[Cell], nets: Sequence[Net]) -> Any:
    """The graph of the cells without edges that close a cycle; ``span`` is the minimum distance in layers."""
    graph: Any = nx.DiGraph()
    graph.add_nodes_from(cells)
    spans = [
        (net.source.cell, target.cell, 1 if net.label is None else 2)
        for net in sorted(nets, key=lambda net: net.label is not None)
        for target in net.targets
    ]
    for (source, target, span), closes in zip(spans, closing(graph, [each[:2] for each in spans]), strict=True):
        if not closes:
            known = graph[source][target]["span"] if graph.has_edge(source, target) else 0
            graph.add_edge(source, target, span=max(span, known))
    return graph


def closing(graph: Any, edges: Sequence[tuple[T, T]]) -> Iterator[bool]:
    """For each edge, whether it would close a cycle in a graph to which the caller adds the edges that do not."""
    every = graph.copy()
    every.add_edges_from(edges)
    knot = {node: number for number, knot in enumerate(nx.strongly_connected_components(every)) for node in knot}
    for source, target in edges:
        yield source is target or (knot[source] == knot[target] and nx.has_path(graph, target, source))


def _spread(net: Net, layers: Layers, runs: Runs) -> None:
    """Divide a net into runs, with a pass in every layer between its ends."""
    start = net.source.cell.layer
    forward = [pin for pin in net.targets if pin.cell.layer > start]
    backward = [pin for pin in net.targets if pin.cell.layer <= start]
    parts: dict[int, Run] = defaultdict(lambda: Run(net, [], []))  # by the layer on the left
    parts[start].left.append(net.source)
    for number in (
        *range(start + 1, max((pin.cell.layer for pin in forward), default=start)),
        *range(start, min((pin.cell.layer for pin in backward), default=start + 1) - 1, -1),
    ):
        cell = Cell("pass", layer=number)
        layers[number].append(cell)
        if net.label is not None and net.labelled is None:
            net.labelled = cell
            cell.width, cell.height = net.label
        parts[number - 1].right.append(cell.pin("left"))
        parts[number].left.append(cell.pin("right"))
        cell.left[0].offset = cell.right[0].offset = cell.height / 2
    for pin in (*forward, *backward):
        parts[pin.cell.layer - 1].right.append(pin)
    for number, run in parts.items():
        runs[number].append(run)


# -- order --------------------------------------------------------------------------------------------------------


def order(layers: Layers, runs: Runs, fixed: Iterable[Cell] = ()) -> None:
    """Order the cells of each layer, and the pins of each box, so that few nets cross.

    ``fixed`` are entries and exits with a given order, which they keep among themselves.
    """
    joints = [_joints(layers, number, here) for number, here in enumerate(runs)]
    given = {cell: place for place, cell in enumerate(fixed)}
    sides = [pins for cells in layers for cell in cells for pins in (cell.left, cell.right)]
    ordered: list[list[Any]] = [*layers, *sides]
    start = best = [[*each] for each in ordered]
    least = _all_crossings(layers, joints)
    for upside_down in (False, True):
        _restore(ordered, start)
        if upside_down:
            for cells in layers:
                cells.reverse()
                _sort(cells, given)
        better = 0  # the last sweep that was
        for number in range(SWEEPS):
            if least == (0, 0) or number - better > PATIENCE:
                break
            for rightwards in (True, False):
                _sweep(layers, joints, given, rightwards)
                found = _all_crossings(layers, joints)
                if found < least:
                    best, least, better = [[*each] for each in ordered], found, number
    _restore(ordered, best)
    for cells in layers:
        cells[:] = [cell for cell in cells if cell.kind != "turn"]


def _restore(ordered: list[list[Any]], state: list[list[Any]]) -> None:
    for each, before in zip(ordered, state, strict=True):
        each[:] = before


def _joints(layers: Layers, number: int, runs: list[Run]) -> list[tuple[Pin, Pin]]:
    """The pairs of pins that the runs to the right of a layer join; where one turns round, a cell keeps its place."""
    pairs: list[tuple[Pin, Pin]] = []
    for run in runs:
        ends = []
        for pins, beyond, side in ((run.left, number, "right"), (run.right, number + 1, "left")):
            if not pins:
                turn = Cell("turn", layer=beyond)
                layers[beyond].append(turn)
                pins = [turn.pin(side)]
            ends.append(pins)
        pairs += product(ends[0], ends[1])
    return pairs


def _sweep(layers: Layers, joints: Joints, given: dict[Cell, int], rightwards: bool) -> None:
    """Order each layer by the connections of its pins to the layer before it, in the given direction."""
    last = len(layers) - 1
    for number in range(1, last + 1) if rightwards else range(last - 1, -1, -1):
        before = number - 1 if rightwards else number + 1
        ranks = _ranks(layers[before], "right" if rightwards else "left")
        there: dict[Pin, list[int]] = {}
        for left, right in joints[min(before, number)]:
            here, far = (right, left) if rightwards else (left, right)
            there.setdefault(here, []).append(ranks[far])
        cells = layers[number]
        means = {pin: sum(found) / len(found) for pin, found in there.items()}
        beside = dict[Cell, list[int]]()
        for cell in cells:
            for pins in (cell.left, cell.right):
                _sort(pins, means)
            beside[cell] = [rank for pin in (*cell.left, *cell.right) for rank in there.get(pin, ())]
        _sort(cells, {cell: sum(found) / len(found) for cell, found in beside.items() if found})
        _sort(cells, given)


def _sort(items: list[T], keys: Mapping[T, float]) -> None:
    """Sort the items that have a key, in the positions that they hold together; the others stay where they are."""
    places = [index for index, item in enumerate(items) if item in keys]
    for index, item in zip(places, sorted((items[index] for index in places), key=keys.__getitem__), strict=True):
        items[index] = item


def _ranks(cells: list[Cell], side: str) -> dict[Pin, int]:
    pins = (pin for cell in cells for pin in (cell.left if side == "left" else cell.right))
    return {pin: rank for rank, pin in enumerate(pins)}


def _all_crossings(layers: Layers, joints: Joints) -> tuple[int, int]:
    """How many lines cross, and in how many of these pairs both lines run between passes.

    Near its end a line changes its height anyway, so a crossing there costs no bends.
    """
    every = between = 0
    for number, pairs in enumerate(joints):
        long = [(one, other) for one, other in pairs if one.cell.kind == other.cell.kind == "pass"]
        every += _crossings(layers[number], layers[number + 1], pairs)
        between += _crossings(layers[number], layers[number + 1], long)
    return every, between


def _crossings(left: list[Cell], right: list[Cell], pairs: list[tuple[Pin, Pin]]) -> int:
    """How many pairs of straight lines between two layers would cross; lines from one pin do not cross each other."""
    ranks, others = _ranks(left, "right"), _ranks(right, "left")
    crossings, above = 0, list[int]()
    for _, ends in groupby(sorted((ranks[one], others[other]) for one, other in pairs), key=itemgetter(0)):
        here = [end for _, end in ends]
        crossings += sum(len(above) - bisect_right(above, end) for end in here)
        for end in here:
            insort(above, end)
    return crossings
