"""Signals over superdense time: pieces that follow each other without a gap.

An instant is a whole nanosecond, and has ``MOMENTS`` moments, one for each sample; the last stands until the
instant is over.  Moments are numbered through: ``moment(time, sample)``.

A piece says what a signal is from its start to its end, both included: a number, a ``Line``, or None where there is
nothing to judge.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

MOMENTS = 2**32  # of an instant: more than it can have samples
TINY = math.ulp(0.0)  # stands for zero on the side of the truth, so that no margin is 0


def moment(time: int, sample: int = 0) -> int:
    """The moment of a sample at a time (ns)."""
    return time * MOMENTS + sample


def time_of(moment: int) -> int:
    """The time (ns) of a moment."""
    return moment // MOMENTS


class Line(NamedTuple):
    """A straight line through two points in time (ns); ``zero`` is what it is where it would be 0."""

    start: int
    first: float
    end: int
    last: float
    zero: float

    def at(self, moment: int) -> float:
        """Its value at a moment between the two."""
        time = time_of(moment)
        if time == self.start:
            return self.first
        if time == self.end:
            return self.last
        value = self.first + (self.last - self.first) * ((time - self.start) / (self.end - self.start))
        return value if value != 0.0 else self.zero

    def earlier(self, by: int) -> Line:
        """The same some ns earlier."""
        return Line(self.start - by, self.first, self.end - by, self.last, self.zero)

    def __neg__(self) -> Line:
        return Line(self.start, -self.first, self.end, -self.last, -self.zero)


Value = float | Line | None


class Piece(NamedTuple):
    """What a signal is from one moment to another, both included."""

    start: int
    end: int
    value: Value


def at(value: float | Line, moment: int) -> float:
    """A value at a moment."""
    return value.at(moment) if isinstance(value, Line) else value


def earlier(pieces: Iterable[Piece], by: int) -> Iterator[Piece]:
    """For each moment, what the signal is where the instant some ns later begins; by 0 ns, the signal itself."""
    if by == 0:
        yield from pieces
        return
    for start, end, value in pieces:
        first, last = max(time_of(start + MOMENTS - 1) - by, 0), time_of(end) - by
        if first <= last:
            moved = value.earlier(by) if isinstance(value, Line) else value
            yield Piece(moment(first), moment(last + 1) - 1, moved)


def negated(pieces: Iterable[Piece]) -> Iterator[Piece]:
    """The signal with its sign changed."""
    for start, end, value in pieces:
        yield Piece(start, end, None if value is None else -value)


def extreme(start: int, end: int, one: float | Line, other: float | Line, greatest: bool) -> Iterator[Piece]:
    """The greater of two values, or the lesser, in as many pieces as it takes."""
    if not isinstance(one, Line) and not isinstance(other, Line):
        yield Piece(start, end, max(one, other) if greatest else min(one, other))
        return

    def is_ours(moment: int) -> bool:
        return (at(one, moment) >= at(other, moment)) == greatest

    ours = is_ours(start)
    turn = end + 1 if is_ours(end) == ours else _first(start, end, is_ours, not ours)
    yield Piece(start, turn - 1, one if ours else other)
    if turn <= end:
        yield Piece(turn, end, other if ours else one)


def by_sign(start: int, end: int, value: float | Line) -> Iterator[Piece]:
    """The value in pieces of which each is above 0 or below throughout."""
    turn = end + 1
    if isinstance(value, Line):
        line = value
        ours = line.at(start) > 0.0
        if (line.at(end) > 0.0) != ours:
            turn = _first(start, end, lambda moment: line.at(moment) > 0.0, not ours)
    yield Piece(start, turn - 1, value)
    if turn <= end:
        yield Piece(turn, end, value)


def _first(start: int, end: int, holds: Callable[[int], bool], wanted: bool) -> int:
    """The first moment after ``start`` at which something is as it is at ``end``; it changes once."""
    while end - start > 1:
        middle = (start + end) // 2
        if holds(middle) == wanted:
            end = middle
        else:
            start = middle
    return end


def overlaid(left: deque[Piece], right: deque[Piece]) -> Iterator[tuple[int, int, Value, Value]]:
    """What two signals are, from one moment to another; that is taken out of both."""
    while left and right:
        (start, first_end, one), (_, second_end, other) = left.popleft(), right.popleft()
        end = min(first_end, second_end)
        if first_end > end:
            left.appendleft(Piece(end + 1, first_end, one))
        if second_end > end:
            right.appendleft(Piece(end + 1, second_end, other))
        yield start, end, one, other
