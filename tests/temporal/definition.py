"""The definition of the operators, word by word: every sample is looked at, one after the other."""

from __future__ import annotations

import math
import random  # noqa: TID251 (what to try, and not what a model draws)
from collections.abc import Iterator

from epicycle.runner.model.temporal import TINY, Line, Piece, Property, Sends, moment
from epicycle.runner.model.temporal.property import Junction, Not, Quantified, Until

Values = list[float | None]  # in the samples, in superdense order


def robustness(tree: Property, signals: Iterator[Values], times: list[int]) -> Values:
    """The robustness of a property in all samples, for the signals of its conditions; ``times`` (ns) of the samples."""
    match tree:
        case Not():
            return [None if value is None else -value for value in robustness(tree.of, signals, times)]
        case Junction():
            left = robustness(tree.left, signals, times)
            pairs = zip(left, robustness(tree.right, signals, times), strict=True)
            return [_joined(tree.any, one, other) for one, other in pairs]
        case Quantified():
            of = robustness(tree.of, signals, times)
            return [_quantified(tree, of, times, sample) for sample in range(len(of))]
        case Until():
            left = [math.inf if value is None else value for value in robustness(tree.left, signals, times)]
            right = [-math.inf if value is None else value for value in robustness(tree.right, signals, times)]
            return [_until(tree, left, right, times, sample) for sample in range(len(left))]
        case _:
            return next(signals)


def _joined(any: bool, one: float | None, other: float | None) -> float | None:
    if one is not None and other is not None:
        return max(one, other) if any else min(one, other)
    known = other if one is None else one
    return known if known is not None and (known > 0) == any else None


def _within(tree: Quantified | Until, times: list[int], sample: int, end: int | None) -> range:
    """The samples from this one on whose time is in its window."""
    first, last = times[sample] + tree.start, times[-1] if end is None else times[sample] + end
    found = [each for each in range(sample, len(times)) if first <= times[each] <= last]
    return range(found[0], found[-1] + 1) if found else range(0)


def _quantified(tree: Quantified, of: Values, times: list[int], sample: int) -> float | None:
    seen = [value for each in _within(tree, times, sample, tree.end) if (value := of[each]) is not None]
    found = max(seen, default=-math.inf) if tree.any else min(seen, default=math.inf)
    is_cut = tree.end is not None and times[sample] + tree.end > times[-1]
    return None if is_cut and (found > 0) != tree.any else found


def _until(tree: Until, left: list[float], right: list[float], times: list[int], sample: int) -> float | None:
    def awaited(end: int | None) -> float:
        samples = _within(tree, times, sample, end)
        return max((min([right[each], *left[sample:each]]) for each in samples), default=-math.inf)

    low = awaited(tree.end)
    if tree.end is None or times[sample] + tree.end <= times[-1] or low > 0:
        return low
    high = max(awaited(None), min(left[sample:]))  # as if it came right after the end
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


def random_times(draw: random.Random) -> list[int]:
    """The times (ns) of samples, from 0 on without a gap: one at most of them, sometimes more."""
    return [time for time in range(draw.randrange(1, 15)) for _ in range(draw.choice([1, 1, 1, 2, 3]))]


def moments_of(times: list[int]) -> list[int]:
    """The moments at which samples of these times begin, and that at which the last one ends."""
    found = [moment(time, number - times.index(time)) for number, time in enumerate(times)]
    return [*found, moment(times[-1] + 1)]


def random_signal(draw: random.Random, times: list[int], *, lines: bool) -> list[Piece]:
    """A signal in samples of these times."""
    moments, last = moments_of(times), len(times) - 1
    pieces, sample = [], 0
    if draw.random() < 0.4:
        sample = draw.randrange(1, last + 2)
        pieces.append(Piece(0, moments[sample] - 1, None))
    while sample <= last:
        end = min(sample + draw.choice([0, 0, 1, 2, 3, 5]), last)
        value: float | Line = _value(draw)
        if lines and times[end] > times[sample] and draw.random() < 0.5:
            start, stop = times[sample] - draw.randrange(2), times[end] + draw.randrange(2)
            value = Line(start, _value(draw), stop, _value(draw), draw.choice([TINY, -TINY]))
        pieces.append(Piece(moments[sample], moments[end + 1] - 1, value))
        sample = end + 1
    return pieces


def _value(draw: random.Random) -> float:
    return float(draw.randrange(-3, 4)) or draw.choice([TINY, -TINY])


def values_of(pieces: list[Piece], times: list[int]) -> Values:
    """A signal in all samples."""
    found: Values = []
    for each in moments_of(times)[:-1]:
        value = next(piece.value for piece in pieces if piece.start <= each <= piece.end)
        found.append(value.at(each) if isinstance(value, Line) else value)
    return found
