"""Where a search looks next: points spread evenly, and then, by CMA-ES, towards less robustness."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterable, Sequence
from itertools import count, product
from typing import Any

from epicycle.actors import random_stream

BATCH = 20  # points that are chosen together
SPREAD = 3  # batches that are spread before the first ones that are guided
STEP = 0.2  # of the edge of the unit cube: how far the first guided points are from the best known one
FINE = 1e-3  # the step at which a descent ends
LONGEST = 15  # batches of a descent
FEW = 4  # signals of which all corners are tried
SMALL = 10  # points of a batch where axes are signals
SHARED = 3  # of so many points, one may have the least margin if there is to be a slope
CHANGES = 3  # of a signal, at most, unless it is guided

Point = tuple[float, ...]  # of the unit cube
Proposals = Generator[list[Point], list[float | None], None]


def is_guided() -> bool:
    """Whether the library is there that guides a search."""
    try:
        import cma  # noqa: F401
    except ImportError:
        return False
    return True


def proposals(widths: Sequence[int], seed: int, guided: bool, together: int = BATCH) -> Proposals:
    """Batches of points, without end; each is sent the robustness that was found at its points.

    An axis has as many numbers as it is wide: one, or those of a signal.  Guided points are chosen so many
    ``together``.  Each batch depends on nothing but the seed and what was found before it.
    """
    axes = sum(widths)
    if axes > len(widths):
        yield from _of_signals(widths, seed, guided)
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


def _of_signals(widths: Sequence[int], seed: int, guided: bool) -> Proposals:
    """Points where axes are signals: constant ones at the ends of their ranges, and then such as rarely change.

    What breaks a property often lies there, and few of the points that are spread evenly do.
    """
    found: list[tuple[float, Point]] = []
    if len(widths) <= FEW:
        corners = list(product((0.0, 1.0), repeat=len(widths)))
        order = random_stream(seed, "corners").permutation(len(corners)).tolist()
        points = [_point(widths, ([share] for share in corners[place])) for place in order]
        found = list(zip(map(_number, (yield points)), points, strict=True))
    for number in count():
        points = stepped(widths, seed, number)
        found += zip(map(_number, (yield points)), points, strict=True)
        least, start = min(found, key=lambda each: each[0])
        shared = len([each for each in found if each[0] == least])
        if guided and least < math.inf and SHARED * shared <= len(found):  # or there is no slope to follow
            yield from _descent(start, seed, number, SMALL, diagonal=True)
        found = []


def stepped(widths: Sequence[int], seed: int, number: int) -> list[Point]:
    """A small batch of points whose signals change at most ``CHANGES`` times.

    Of every two points, one has its values at the ends of the ranges.
    """
    points = []
    for place in range(SMALL):
        stream = random_stream(seed, f"stepped {number}", str(place))
        levels = []
        for width in widths:
            values = [stream.random() for _ in range(1 + int(stream.random() * min(width, CHANGES + 1)))]
            levels.append([float(value < 0.5) for value in values] if place % 2 else values)
        points.append(_point(widths, levels, stream))
    return points


def _point(widths: Sequence[int], levels: Iterable[Sequence[float]], stream: Any = None) -> Point:
    """The point of signals that have these levels one after the other, and change at random places."""
    shares: list[float] = []
    for width, values in zip(widths, levels, strict=True):
        places = (
            [0, *sorted(1 + each for each in stream.permutation(width - 1).tolist()[: len(values) - 1])]
            if stream and width > 1
            else [0]
        )
        ends = [*places[1:], width]
        for value, start, end in zip(values, places, ends, strict=False):
            shares += [value] * (end - start)
    return tuple(shares)


def spread(axes: int, seed: int, number: int) -> list[Point]:
    """Points of which, on each axis, each of as many slices has one: a Latin hypercube."""
    columns = []
    for axis in range(axes):
        stream = random_stream(seed, f"axis {axis}", f"spread {number}")
        columns.append([(slice_ + stream.random()) / BATCH for slice_ in stream.permutation(BATCH).tolist()])
    return list(zip(*columns, strict=True)) if columns else [()] * BATCH


def _descent(start: Point, seed: int, number: int, together: int, diagonal: bool = False) -> Proposals:
    """Points of CMA-ES from a point on, until its step is small; if ``diagonal``, with a step for each axis alone."""
    import cma
    import numpy as np

    stream = random_stream(seed, "descent", str(number))

    def normal(*shape: int) -> Any:
        return np.array([stream.normal(0.0, 1.0) for _ in range(math.prod(shape))]).reshape(shape)

    width = max(len(start), 2)  # the library knows no fewer; the rest is for nothing
    options = {"bounds": [0.0, 1.0], "randn": normal, "seed": math.nan, "tolx": FINE, "verbose": -9}
    options |= {"CMA_diagonal": diagonal, "tolfunhist": 0.0}  # the least of each batch is the same: its rank
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
