"""Where a search looks next: points spread evenly, and then, by CMA-ES, towards less robustness."""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from typing import Any

from epicycle.actors import random_stream

BATCH = 20  # points that are chosen together
SPREAD = 3  # batches that are spread before the first ones that are guided
STEP = 0.2  # of the edge of the unit cube: how far the first guided points are from the best known one
FINE = 1e-3  # the step at which a descent ends
LONGEST = 15  # batches of a descent

Point = tuple[float, ...]  # of the unit cube
Proposals = Generator[list[Point], list[float | None], None]


def is_guided() -> bool:
    """Whether the library is there that guides a search."""
    try:
        import cma  # noqa: F401
    except ImportError:
        return False
    return True


def proposals(axes: int, seed: int, guided: bool, together: int = BATCH) -> Proposals:
    """Batches of points, without end; each is sent the robustness that was found at its points.

    Guided points are chosen so many ``together``.

    Each batch depends on nothing but the seed and what was found before it.
    """
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


def spread(axes: int, seed: int, number: int) -> list[Point]:
    """Points of which, on each axis, each of as many slices has one: a Latin hypercube."""
    columns = []
    for axis in range(axes):
        stream = random_stream(seed, f"axis {axis}", f"spread {number}")
        columns.append([(slice_ + stream.random()) / BATCH for slice_ in stream.permutation(BATCH).tolist()])
    return list(zip(*columns, strict=True)) if columns else [()] * BATCH


def _descent(start: Point, seed: int, number: int, together: int) -> Proposals:
    """Points of CMA-ES from a point on, until its step is small."""
    import cma
    import numpy as np

    stream = random_stream(seed, "descent", str(number))

    def normal(*shape: int) -> Any:
        return np.array([stream.normal(0.0, 1.0) for _ in range(math.prod(shape))]).reshape(shape)

    width = max(len(start), 2)  # the library knows no fewer; the rest is for nothing
    options = {"bounds": [0.0, 1.0], "randn": normal, "seed": math.nan, "tolx": FINE, "verbose": -9}
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
