"""The definition of the operators, word by word: every time is looked at, one after the other."""

from __future__ import annotations

import math
import random  # noqa: TID251 (what to try, and not what a model draws)
from collections.abc import Iterator

from epicycle.runner.temporal import TINY, Line, Piece, Property, Sends
from epicycle.runner.temporal.property import Junction, Not, Quantified, Until

Values = list[float | None]  # at 0 ns, 1 ns, ...


def robustness(tree: Property, signals: Iterator[Values]) -> Values:
    """The robustness of a property at all times, for the signals of its conditions, in their order."""
    match tree:
        case Not():
            return [None if value is None else -value for value in robustness(tree.of, signals)]
        case Junction():
            left = robustness(tree.left, signals)
            pairs = zip(left, robustness(tree.right, signals), strict=True)
            return [_joined(tree.any, one, other) for one, other in pairs]
        case Quantified():
            of = robustness(tree.of, signals)
            return [_quantified(tree, of, time) for time in range(len(of))]
        case Until():
            left = [math.inf if value is None else value for value in robustness(tree.left, signals)]
            right = [-math.inf if value is None else value for value in robustness(tree.right, signals)]
            return [_until(tree, left, right, time) for time in range(len(left))]
        case _:
            return next(signals)


def _joined(any: bool, one: float | None, other: float | None) -> float | None:
    if one is not None and other is not None:
        return max(one, other) if any else min(one, other)
    known = other if one is None else one
    return known if known is not None and (known > 0) == any else None


def _quantified(tree: Quantified, of: Values, time: int) -> float | None:
    last = len(of) - 1
    end = last if tree.end is None else min(time + tree.end, last)
    seen = [value for value in of[time + tree.start : end + 1] if value is not None]
    found = max(seen, default=-math.inf) if tree.any else min(seen, default=math.inf)
    is_cut = tree.end is not None and time + tree.end > last
    return None if is_cut and (found > 0) != tree.any else found


def _until(tree: Until, left: list[float], right: list[float], time: int) -> float | None:
    last = len(left) - 1

    def awaited(end: int) -> float:
        times = range(time + tree.start, min(end, last) + 1)
        return max((min([right[each], *left[time:each]]) for each in times), default=-math.inf)

    if tree.end is None:
        return awaited(last)
    low = awaited(time + tree.end)
    if time + tree.end <= last or low > 0:
        return low
    high = max(awaited(last), min(left[time:]))  # as if it came right after the end
    return high if high < 0 else None


# -- random ones ------------------------------------------------------------------------------------------------------


def random_property(draw: random.Random, depth: int, *, unbounded: bool = True) -> Property:
    """A property of some depth."""

    def inner() -> Property:
        return random_property(draw, depth - 1, unbounded=unbounded)

    kind = draw.random()
    if depth == 0 or kind < 0.15:
        return Sends("a.b")
    if kind < 0.3:
        return Not(inner())
    if kind < 0.5:
        return Junction(draw.random() < 0.5, inner(), inner())
    start = draw.choice([0, 0, 1, 2, draw.randrange(6)])
    ends = [None] if unbounded else []
    end = draw.choice([*ends, start, start + draw.randrange(5)])
    if kind < 0.85:
        return Quantified(draw.random() < 0.5, inner(), start, end)
    return Until(inner(), inner(), start, end)


def random_signal(draw: random.Random, last: int, *, lines: bool) -> list[Piece]:
    """A signal from 0 ns to the last time."""
    pieces, time = [], 0
    if draw.random() < 0.4:
        time = draw.randrange(1, last + 2)
        pieces.append(Piece(0, time - 1, None))
    while time <= last:
        end = min(time + draw.choice([0, 0, 1, 2, 3, 5]), last)
        value: float | Line = _value(draw)
        if lines and end > time and draw.random() < 0.5:
            start, stop = time - draw.randrange(2), end + draw.randrange(2)
            value = Line(start, _value(draw), stop, _value(draw), draw.choice([TINY, -TINY]))
        pieces.append(Piece(time, end, value))
        time = end + 1
    return pieces


def _value(draw: random.Random) -> float:
    return float(draw.randrange(-3, 4)) or draw.choice([TINY, -TINY])


def values_of(pieces: list[Piece], last: int) -> Values:
    """A signal at all times."""
    return [
        each.value.at(time) if isinstance(each.value, Line) else each.value
        for each in pieces
        for time in range(each.start, min(each.end, last) + 1)
    ]
