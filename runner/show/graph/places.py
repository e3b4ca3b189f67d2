"""Places: the height of each cell, and the track on which each net changes its height.

Heights come from a linear programme: it makes the vertical distances of all nets as short as the order of the cells
allows, so nets are straight wherever possible.  Its solutions are whole numbers (every constraint is a difference of
two variables), so rounding makes them exact.

Between two layers a run has one vertical line, its trunk.  Trunks whose heights overlap take different tracks, in the
order with the fewest crossings (Sander, "Layout of directed hypergraphs with orthogonal hyperedges", 2003); if the ends
of two runs are at one height on opposite sides, that order also keeps their horizontal lines apart.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import chain, pairwise
from typing import Any

import networkx as nx
import numpy as np
from numpy.typing import NDArray

from .layers import Cell, Layers, Pin, Run, Runs, closing

Floats = NDArray[np.float64]
Gap = tuple[int, int, float]  # a cell, the one below it, and how far apart they are at least
Pull = tuple[int, int, float, float]  # two cells, the offset at which the line between them is straight, and its weight

BOX_GAP, LINE_GAP, PORT_GAP = 20.0, 12.0, 4.0
APART = 6.0  # lines nearer than this look like one


def place(layers: Layers, runs: Runs) -> float:
    """Set the ``y`` of every cell; returns the total height."""
    cells = [cell for layer in layers for cell in layer]
    if not cells:
        return 0.0
    number = {cell: index for index, cell in enumerate(cells)}
    gaps = [
        (number[above], number[below], above.height + _gap(above, below))
        for layer in layers
        for above, below in pairwise(layer)
    ]
    pulls = [
        (number[one.cell], number[other.cell], other.offset - one.offset, weight)
        for run in chain.from_iterable(runs)
        for one, other, weight in _pulls(run)
        if one.cell is not other.cell
    ]
    for cell, y in zip(cells, _heights(len(cells), tuple(gaps), tuple(pulls)), strict=True):
        cell.y = y
    return max(cell.y + cell.height for cell in cells)


@lru_cache(maxsize=1024)  # composites of one class are alike, and most stay as they are while somebody writes a model
def _heights(cells: int, gaps: tuple[Gap, ...], pulls: tuple[Pull, ...]) -> tuple[float, ...]:
    weights = np.array([weight for *_, weight in pulls])
    heights, bends = _shortest(cells, gaps, pulls, weights)
    for _ in range(2):  # and again with small bends expensive: many bends disturb a reader more than a long line
        heights, bends = _shortest(cells, gaps, pulls, weights * (1.0 + 30.0 / (1.0 + bends)))
    return tuple(map(float, heights))


def _shortest(cells: int, gaps: tuple[Gap, ...], pulls: tuple[Pull, ...], weights: Floats) -> tuple[Floats, Floats]:
    """Solve the linear programme: the heights of the cells, and the bend of each pull."""
    from scipy.optimize import linprog
    from scipy.sparse import csr_matrix

    # Variables: the top of each cell, then the bend of each pull; a small weight on the tops keeps everything together.
    rows: list[dict[int, float]] = [{above: 1.0, below: -1.0} for above, below, _ in gaps]
    bounds = [-gap for *_, gap in gaps]
    for index, (one, other, offset, _) in enumerate(pulls):
        rows += [{one: sign, other: -sign, cells + index: -1.0} for sign in (1.0, -1.0)]
        bounds += [offset, -offset]
    if not rows:
        return np.zeros(cells), np.zeros(0)
    entries = [(row, column, factor) for row, line in enumerate(rows) for column, factor in line.items()]
    at, columns, factors = zip(*entries, strict=True)
    matrix = csr_matrix((factors, (at, columns)), shape=(len(rows), cells + len(pulls)))
    cost = np.concatenate([np.full(cells, 1e-3), weights])
    solution: Any = linprog(cost, A_ub=matrix, b_ub=bounds, bounds=(0, None), method="highs-ds")
    heights = np.round(solution.x[:cells])
    bends = [abs(heights[one] - heights[other] - offset) for one, other, offset, _ in pulls]
    return heights, np.array(bends)


def _gap(above: Cell, below: Cell) -> float:
    if above.kind == below.kind == "box":
        return BOX_GAP
    return PORT_GAP if {above.kind, below.kind} <= {"entry", "exit"} else LINE_GAP


def _pulls(run: Run) -> list[tuple[Pin, Pin, float]]:
    """The pairs of pins that should be at one height, with weights: long nets should be straight first."""
    if run.left and run.right:
        pairs = [(one, other) for one in run.left for other in run.right]
    else:
        pairs = list(pairwise(run.left or run.right))
    weights = {0: 1.0, 1: 2.0, 2: 8.0}
    return [(one, other, weights[(one.cell.kind == "pass") + (other.cell.kind == "pass")]) for one, other in pairs]


# -- tracks -------------------------------------------------------------------------------------------------------


@dataclass(eq=False)
class Trunk:
    """A vertical line of runs: the heights at which lines reach it from the left and from the right."""

    runs: tuple[Run, ...]
    left: list[float]
    right: list[float]
    track: int = 0
    x: float = 0.0  # of its track
    low: float = field(init=False)
    high: float = field(init=False)

    def __post_init__(self) -> None:
        self.low, self.high = min(self.left + self.right), max(self.left + self.right)


def tracks(runs: Sequence[Run]) -> tuple[list[Trunk], int]:
    """The trunks of the runs between two layers, and how many tracks they need.

    Runs from single pins to the same pin share one.  A run that is one straight line has none; one that would touch
    others on a single track has two.
    """
    groups: dict[object, list[Run]] = {}
    for run in runs:
        groups.setdefault(run.right[0] if len(run.left) == len(run.right) == 1 else run, []).append(run)
    trunks: list[Trunk] = []
    taken: set[float] = set()
    for group in groups.values():
        left = [pin.y for run in group for pin in run.left]
        right = sorted({pin.y for run in group for pin in run.right})
        taken.update(left, right)
        if len({*left, *right}) > 1:
            trunks.append(Trunk(tuple(group), left, right))
    while knots := [sorted(knot) for knot in nx.strongly_connected_components(_required(trunks)) if len(knot) > 1]:
        split = min((trunks[index] for index in min(knots)), key=lambda trunk: len(trunk.left) + len(trunk.right))
        level = _free_height(sorted(taken), (split.low + split.high) / 2)
        taken.add(level)
        at = trunks.index(split)
        trunks[at : at + 1] = [Trunk(split.runs, split.left, [level]), Trunk(split.runs, [level], split.right)]
    graph = _precedence(trunks)
    for index in nx.topological_sort(graph):
        trunks[index].track = max((trunks[before].track + 1 for before in graph.predecessors(index)), default=0)
    return trunks, max((trunk.track + 1 for trunk in trunks), default=0)


def _free_height(taken: list[float], wanted: float) -> float:
    """The height nearest to the wanted one that is free of lines."""
    between = [(low + high) / 2 for low, high in pairwise(taken) if high - low >= 2 * APART]
    outside = [taken[0] - 2 * APART, taken[-1] + 2 * APART]
    return min((*between, *outside), key=lambda height: abs(height - wanted))


def _meeting(trunks: list[Trunk]) -> Iterator[tuple[int, int]]:
    """The pairs of trunks whose heights overlap, and which thus cannot share a track."""
    by_height = sorted(range(len(trunks)), key=lambda index: trunks[index].low)
    for place, one in enumerate(by_height):
        for other in by_height[place + 1 :]:
            if trunks[other].low > trunks[one].high + APART:
                break
            yield (one, other) if one < other else (other, one)


def _required(trunks: list[Trunk]) -> Any:
    """Which trunk must be left of which, so that their horizontal lines do not overlap."""
    graph: Any = nx.DiGraph()
    graph.add_nodes_from(range(len(trunks)))
    for pair in _meeting(trunks):
        for one, other in (pair, pair[::-1]) if trunks[pair[0]].runs is not trunks[pair[1]].runs else ():
            if any(abs(left - right) < APART for left in trunks[one].left for right in trunks[other].right):
                graph.add_edge(one, other)
    return graph


def _precedence(trunks: list[Trunk]) -> Any:
    """Which trunk is left of which: first what is required, then what avoids most crossings."""
    graph = _required(trunks)
    wishes: list[tuple[int, int, int]] = []
    for one, other in _meeting(trunks):
        a, b = trunks[one], trunks[other]
        if a.runs is b.runs:
            graph.add_edge(one, other)
        elif not graph.has_edge(one, other) and not graph.has_edge(other, one):
            saved = _crossings(b, a) - _crossings(a, b)
            wishes.append((saved, one, other) if saved >= 0 else (-saved, other, one))
    wishes.sort(key=lambda wish: (-wish[0], *wish[1:]))
    pairs = [wish[1:] for wish in wishes]
    for (one, other), closes in zip(pairs, closing(graph, pairs), strict=True):
        graph.add_edge(*((other, one) if closes else (one, other)))
    return graph


def _crossings(one: Trunk, other: Trunk) -> int:
    """How many lines cross if ``one`` is left of ``other``."""
    return sum(other.low < height < other.high for height in one.right) + sum(
        one.low < height < one.high for height in other.left
    )
