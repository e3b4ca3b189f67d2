"""Where a search looks next: points spread evenly, and then, by CMA-ES, towards less robustness; or signals."""

from __future__ import annotations

import math
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from typing import Any

from epicycle.actors import Stream, random_stream

from ..model.language.sampling import latin_hypercube

BATCH = 20  # points that are chosen together
SPREAD = 3  # batches that are spread before the first ones that are guided
STEP = 0.2  # of the edge of the unit cube: how far the first guided points are from the best known one
FINE = 1e-3  # the step at which a descent ends
LONGEST = 15  # batches of a descent
FEW = 4  # signals of which all corners are tried
SMALL = 4  # points of a batch where axes are signals
SHARED = 3  # of so many points, one may have the least robustness if that is to say where to look
AFRESH = 0.35  # of the points of signals
EVENLY = 0.2  # of these, in whatever way
NEXT = 0.3  # how likely not the best of some points is changed, but the next one
GOOD = 0.15  # of the points that are chosen afresh: those by which ways are judged
PIECES = 4  # of a signal, at most, unless it is dense


Point = tuple[float, ...]  # of the unit cube


@dataclass(frozen=True, eq=False)
class Way:
    """How signals are chosen: a new level at each place or few levels; any level, or only the ends of the range."""

    is_dense: bool
    at_ends: bool


WAYS = DENSE, DENSE_AT_ENDS, SPARSE, AT_ENDS = Way(True, False), Way(True, True), Way(False, False), Way(False, True)

Proposals = Generator[list[Point], list[float | None], None]


def proposals(widths: Sequence[int], seed: int, guided: bool, together: int = BATCH) -> Proposals:
    """Batches of points, without end; each is sent the robustness that was found at its points.

    An axis has as many numbers as it is wide: one, or those of a signal.  Guided points are chosen so many
    ``together``.  Each batch depends on nothing but the seed and what was found before it.
    """
    axes = sum(widths)
    if max(widths, default=0) > 1:
        yield from _of_signals(widths, seed)
    spreads, descents = 0, 0
    while True:
        found: list[tuple[float, Point]] = []
        for _ in range(SPREAD if not spreads else 1):
            points = spread(axes, seed, spreads)
            spreads += 1
            found += zip(map(_number, (yield points)), points, strict=True)
        least, start = min(found, key=lambda each: each[0])
        if guided and least < math.inf:  # or there is no slope to follow
            yield from _descent(start, seed, descents, together)
            descents += 1


def _of_signals(widths: Sequence[int], seed: int) -> Proposals:
    """Points where axes are signals, in small batches.

    What breaks a property often lies where signals are constant at the ends of their ranges, and few of the points that
    are spread evenly do; so that is where it begins.  Then some are chosen afresh, in one of four ways, the oftener the
    more of a way's points are among those of least robustness; and the others are changed from the best ones.  If many
    points are best, robustness tells nothing of where to look, and all are chosen afresh, and as different as can be.
    """
    signals = _Signals(widths)
    if len(widths) <= FEW:
        stream = random_stream(seed, "corners")
        corner = tuple(float(stream.random() < 0.5) for _ in widths)
        chosen = [signals.constant(corner), signals.fresh(stream, DENSE)]
        corners = {corner: signals.add(chosen, (yield [each.point for each in chosen]))}
        while (beside := _beside(corners)) is not None:
            chosen = [signals.constant(beside)]
            corners[beside] = signals.add(chosen, (yield [each.point for each in chosen]))
    for number in count():
        chosen = [signals.chosen(random_stream(seed, f"signals {number}", str(place))) for place in range(SMALL)]
        signals.add(chosen, (yield [each.point for each in chosen]))


def _beside(corners: Mapping[Point, float]) -> Point | None:
    """A corner that was not tried, as near as there is to the one of least robustness."""
    for corner in sorted(corners, key=corners.__getitem__):
        for place in range(len(corner)):
            beside = (*corner[:place], 1.0 - corner[place], *corner[place + 1 :])
            if beside not in corners:
                return beside
    return None


@dataclass(frozen=True)
class _Chosen:
    """A point, and how it was chosen: in a way, or by a change of another one."""

    point: Point
    way: Way | None
    is_nudged: bool = False
    before: float = math.inf  # the robustness of the other one


class _Signals:
    """What was tried of some signals, and what to try next."""

    def __init__(self, widths: Sequence[int]) -> None:
        self._widths = widths
        self._tried: list[tuple[float, int, _Chosen]] = []  # least robustness first, then the latest
        self._changed = {True: [1, 2], False: [1, 2]}  # by nudges or not: how many were better than before, and all

    def add(self, chosen: Sequence[_Chosen], found: Sequence[float | None]) -> float:
        """Say what was found at points; gives the robustness of the first."""
        numbers = list(map(_number, found))
        for each, number in zip(chosen, numbers, strict=False):
            self._tried.append((number, -len(self._tried), each))
            if each.way is None:
                counted = self._changed[each.is_nudged]
                counted[0] += number < each.before
                counted[1] += 1
        self._tried.sort(key=lambda each: each[:2])
        return numbers[0]

    def chosen(self, stream: Stream) -> _Chosen:
        """A point."""
        tried = self._tried
        if not tried or SHARED * len([each for each in tried if each[0] == tried[0][0]]) > len(tried):
            return self.fresh(stream, DENSE if stream.random() < 0.75 else DENSE_AT_ENDS)
        if stream.random() < AFRESH:
            return self.fresh(stream, self._way(stream))
        place = 0
        while place + 1 < len(tried) and stream.random() < NEXT:
            place += 1
        before, _, parent = tried[place]
        nudges, others = (better / made for better, made in map(self._changed.__getitem__, (True, False)))
        is_nudged = stream.random() < 0.1 + 0.8 * nudges / (nudges + others)
        change = self._nudged if is_nudged else self._rewritten
        return _Chosen(change(stream, parent.point), None, is_nudged, before)

    def _way(self, stream: Stream) -> Way:
        """A way of choosing points, by how many of them were good until now."""
        afresh = [(number, each.way) for number, _, each in self._tried if each.way is not None]
        good = afresh[int(GOOD * len(afresh))][0]
        shares = []
        for way in WAYS:
            found = [number for number, by in afresh if by is way]
            shares.append((len([each for each in found if each <= good]) + 0.5) / (len(found) + 1))
        total, place = math.fsum(shares), stream.random()
        for way, share in zip(WAYS, shares, strict=True):
            place -= EVENLY / len(WAYS) + (1.0 - EVENLY) * share / total
            if place < 0.0:
                return way
        return WAYS[-1]

    def constant(self, levels: Sequence[float]) -> _Chosen:
        """The point of constant signals."""
        point = (level for level, width in zip(levels, self._widths, strict=True) for _ in range(width))
        return _Chosen(tuple(point), AT_ENDS)

    def fresh(self, stream: Stream, way: Way) -> _Chosen:
        """A point that has nothing to do with any other."""
        shares: list[float] = []
        for width in self._widths:
            pieces = width if way.is_dense else 1 + int(stream.random() * min(width, PIECES))
            starts = [0, *sorted(1 + each for each in stream.permutation(width - 1).tolist()[: pieces - 1])]
            for start, end in zip(starts, [*starts[1:], width], strict=True):
                level = stream.random()
                shares += [float(level < 0.5) if way.at_ends else level] * (end - start)
        return _Chosen(tuple(shares), way)

    def _nudged(self, stream: Stream, point: Point) -> Point:
        """A point all of whose levels are a little different."""
        step = STEP * (0.1 + 0.9 * stream.random() * stream.random())
        shares: list[float] = []
        for width in self._widths:
            start = len(shares)
            for place in range(start, start + width):
                if place > start and point[place] == point[place - 1]:
                    shares.append(shares[-1])
                else:
                    shares.append(min(max(point[place] + stream.normal(0.0, step), 0.0), 1.0))
        return tuple(shares)

    def _rewritten(self, stream: Stream, point: Point) -> Point:
        """A point of which a part of a signal or two has another level, maybe the one beside it."""
        shares = list(point)
        for _ in range(1 if stream.random() < 0.6 else 2):
            signal = int(stream.random() * len(self._widths))
            start, width = sum(self._widths[:signal]), self._widths[signal]
            first, last = sorted(start + int(stream.random() * width) for _ in range(2))
            kind, level = stream.random(), stream.random()
            if kind < 0.3:
                level = shares[first if level < 0.5 else last]
            elif kind < 0.65:
                level = float(level < 0.5)
            shares[first : last + 1] = [level] * (last + 1 - first)
        return tuple(shares)


def spread(axes: int, seed: int, number: int) -> list[Point]:
    """Points of which, on each axis, each of as many slices has one: a Latin hypercube."""
    names = [f"axis {axis}" for axis in range(axes)]
    return latin_hypercube(BATCH, seed, names, f"spread {number}") or [()] * BATCH


def _descent(start: Point, seed: int, number: int, together: int) -> Proposals:
    """Points of CMA-ES from a point on, until its step is small."""
    import cma
    import numpy as np

    stream = random_stream(seed, "descent", str(number))

    def normal(*shape: int) -> Any:
        return np.array([stream.normal(0.0, 1.0) for _ in range(math.prod(shape))]).reshape(shape)

    width = max(len(start), 2)  # the library knows no fewer; the rest is for nothing
    options = {"bounds": [0.0, 1.0], "randn": normal, "seed": math.nan, "tolx": FINE, "verbose": -9}
    options |= {"tolfunhist": 0.0}  # the least of each batch is the same: its rank
    options |= {"popsize": together, "maxiter": LONGEST * BATCH // together}
    strategy = cma.CMAEvolutionStrategy([*start, *[0.5] * (width - len(start))], STEP, options)
    while not strategy.stop():
        asked = strategy.ask()
        found = yield [tuple(float(share) for share in each[: len(start)]) for each in asked]
        strategy.tell(asked, ranks(found))


def ranks(found: Sequence[float | None]) -> list[float]:
    """How many values each is above: all that CMA-ES needs, and finite where robustness is not."""
    numbers = list(map(_number, found))
    places = {each: float(place) for place, each in enumerate(sorted(set(numbers)))}
    return [places[each] for each in numbers]


def _number(robustness: float | None) -> float:
    """What is not known counts as holding by any margin."""
    return math.inf if robustness is None or math.isnan(robustness) else robustness
