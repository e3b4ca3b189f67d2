"""Sets of single acts of aspects, as what a search varies: those of one run, of which few are let happen."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from heapq import heappop, heappush
from itertools import islice

from epicycle.actors import random_stream

from ..model.graph.acts import ActName
from ..model.language.dimensions import Dimension, Level, Listed, as_factor
from ..model.language.disturbance import EXACTLY
from ..model.language.settings import Setting
from ..model.text.files import COMMAND_LINE
from ..model.text.problems import Position
from ..model.text.program import node_of
from .proposals import BATCH, Point, Proposals, ranks
from .space import Axis

_OPTION = Position(COMMAND_LINE, 1, 1, 1, "--max-faults")
_VALUES = 8  # numbers in the text of a study that an act takes, about


class FaultSpace:
    """All sets of at most ``most`` of some acts; a point has their places among ``acts``."""

    axes: tuple[Axis, ...] = ()
    has_ranges = False

    def __init__(self, acts: Sequence[ActName], most: int) -> None:
        self.acts = tuple(acts)
        self.most = min(most, len(acts))
        self.columns = {EXACTLY: "text"}
        self.width = _VALUES * self.most
        self.content = "faults"

    def level(self, point: Point) -> Level:
        """The acts of a point, and no others."""
        acts = [self.acts[int(place)] for place in point]
        node = node_of([{"aspect": each.aspect, "at": each.place, "token": each.token} for each in acts], _OPTION)
        return Level((Setting(EXACTLY, node, _OPTION),), {EXACTLY: as_factor(node, "text")})

    def dimensions(self, levels: Sequence[Level]) -> tuple[Dimension, ...]:
        """These points, as what a study varies."""
        return (Listed("point", _OPTION, self.columns, list(levels)),)

    def ends(self) -> tuple[Dimension, ...]:
        """All acts at once, and none: with both, a model must load."""
        return self.dimensions([self.level(tuple(range(len(self.acts)))), self.level(())])

    def sizes(self) -> list[int]:
        """How many sets there are of 0 acts, 1 act, and so on."""
        return [math.comb(len(self.acts), size) for size in range(self.most + 1)]

    def proposals(self, seed: int) -> Proposals:
        """Batches of sets until all have been: smaller sets first, and of one size those of the worst acts first.

        The worst are those with the least robustness alone; single acts come in a random order.
        """
        order = random_stream(seed, "acts").permutation(len(self.acts)).tolist()
        alone: list[float | None] = []
        sets: Iterator[Point] = iter([(), *((place,) for place in order)])
        while batch := list(islice(sets, BATCH)):
            alone += yield batch
        places = ranks(alone[1:])
        worst = [place for _, place in sorted(zip(places, order, strict=True), key=lambda each: each[0])]
        for size in range(2, self.most + 1):
            sets = (tuple(worst[rank] for rank in each) for each in _by_sum(size, len(worst)))
            while batch := list(islice(sets, BATCH)):
                yield batch


def _by_sum(size: int, count: int) -> Iterator[tuple[int, ...]]:
    """All sets of so many numbers below ``count``, those with the least sum first."""
    least = tuple(range(size))
    waiting, seen = [(math.comb(size, 2), least)], {least}  # by their sums
    while waiting:
        total, each = heappop(waiting)
        yield each
        for place, following in enumerate([*each[1:], count]):
            more = (*each[:place], each[place] + 1, *each[place + 1 :])
            if more[place] < following and more not in seen:
                seen.add(more)
                heappush(waiting, (total + 1, more))
