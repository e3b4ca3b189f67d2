"""Operators: the robustness of a property over time, worked out while the signals come in.

``take(over)`` gives the pieces of an operator's signal that have become certain since it was asked last; with ``over``
nothing comes after what has come in.

There is nothing to judge (None) in a condition before each of its ports has sent, and in a window that reaches beyond
the end of the run, unless what is there decides.  ``always`` and ``eventually`` leave that out.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator
from typing import Any, Protocol

from .property import Junction, Not, Property, Quantified, Until
from .signal import Line, Piece, Value, at, by_sign, earlier, extreme, moment, negated, overlaid, time_of

Found = list[Piece]


class Operator(Protocol):
    """Something with a signal."""

    def take(self, over: bool) -> Found:
        """See the module."""


class Source:
    """The signal of a condition, which somebody lets grow."""

    __slots__ = ("pieces",)

    def __init__(self, pieces: Iterable[Piece] = ()) -> None:
        self.pieces: Found = list(pieces)

    def take(self, over: bool) -> Found:
        """See the module."""
        found, self.pieces = self.pieces, []
        return found


class Negation:
    """``not``."""

    __slots__ = ("_of",)

    def __init__(self, of: Operator) -> None:
        self._of = of

    def take(self, over: bool) -> Found:
        """See the module."""
        return list(negated(self._of.take(over)))


class Joining:
    """``and``, or ``or`` if ``any``."""

    __slots__ = ("_any", "_first", "_left", "_right", "_second")

    def __init__(self, any: bool, left: Operator, right: Operator) -> None:
        self._any = any
        self._left = left
        self._right = right
        self._first: deque[Piece] = deque()
        self._second: deque[Piece] = deque()

    def take(self, over: bool) -> Found:
        """See the module."""
        self._first.extend(self._left.take(over))
        self._second.extend(self._right.take(over))
        found: Found = []
        for start, end, one, other in overlaid(self._first, self._second):
            if one is not None and other is not None:
                found += extreme(start, end, one, other, self._any)
            else:
                found += _deciding(start, end, other if one is None else one, self._any)
        return found


def _deciding(start: int, end: int, value: Value, positive: bool) -> Found:
    """A value where its sign decides whatever else there may be, above 0 if ``positive``; elsewhere nothing."""
    if value is None:
        return [Piece(start, end, None)]
    pieces = by_sign(start, end, value)
    return [each if (at(value, each.start) > 0.0) == positive else each._replace(value=None) for each in pieces]


def _append(pieces: list[Piece] | deque[Piece], piece: Piece) -> None:
    """Let a signal grow; what stays as it is becomes one piece."""
    if pieces and not isinstance(piece.value, Line) and pieces[-1].value == piece.value:
        piece = Piece(pieces.pop().start, piece.end, piece.value)
    pieces.append(piece)


class Window:
    """``always``, or ``eventually`` if ``any``, from ``start`` to ``end`` ns later.

    A piece has its extremes at its ends, so that of a window is the extreme of its own two ends and of the ends of
    pieces between them.  Source of the queue of those: Lemire, Nordic Journal of Computing 13, 2006.
    """

    __slots__ = ("_any", "_back", "_end", "_ends", "_front", "_last", "_next", "_of", "_start")

    def __init__(self, any: bool, of: Operator, start: int, end: int) -> None:
        self._any = any
        self._of = of
        self._start = start
        self._end = end
        self._next = 0  # the moment that its own signal has not come to yet
        self._back: deque[Piece] = deque()  # the piece in which the window of that moment begins, and all after it
        self._front: deque[Piece] = deque()  # the same of the window's end
        self._ends: deque[tuple[int, float]] = deque()  # ends of pieces between them that may be its extreme
        self._last: int | None = None  # the end of the run, once it is known

    def take(self, over: bool) -> Found:
        """See the module."""
        for piece in self._of.take(over):
            self._put(piece)
        if over and self._last is None and self._back:
            self._last = self._back[-1].end
            self._put(Piece(self._last + 1, self._last + moment(self._end + 1), None))
        found: Found = []
        if not self._back:
            return found
        known = self._ending_by(self._back[-1].end) if self._last is None else self._last
        while (now := self._next) <= known:
            self._slide(now)
            until = min(self._beginning_by(self._back[0].end), self._ending_by(self._front[0].end), known)
            if self._ends:
                until = min(until, self._beginning_by(self._ends[0][0]))
            is_cut = self._last is not None and self._ends_at(now) > self._last
            if self._last is not None and not is_cut:
                until = min(until, self._ending_by(self._last))
            pieces = self._extreme(now, until)
            if is_cut:
                pieces = [part for each in pieces for part in _deciding(*each, self._any)]
            found += pieces
            self._next = until + 1
        return found

    def _put(self, piece: Piece) -> None:
        for pieces in (self._back, self._front):
            _append(pieces, piece)

    def _begins_at(self, now: int) -> int:
        """The first moment of the window of a moment: that itself, or where the instant begins ``start`` ns later."""
        return moment(time_of(now) + self._start) if self._start else now

    def _ends_at(self, now: int) -> int:
        """The last moment of that window: the last of the instant ``end`` ns later."""
        return moment(time_of(now) + self._end + 1) - 1

    def _beginning_by(self, then: int) -> int:
        """The last moment whose window begins by then."""
        return moment(time_of(then) - self._start + 1) - 1 if self._start else then

    def _ending_by(self, then: int) -> int:
        """The last moment whose window ends by then."""
        return moment(time_of(then + 1) - self._end) - 1

    def _slide(self, now: int) -> None:
        """Let the window be that of a moment."""
        begin, end = self._begins_at(now), self._ends_at(now)
        while self._back[0].end < begin:
            self._back.popleft()
        while self._front[0].end < end:
            passed = self._front.popleft()
            self._enter(passed.end, passed.value)
            if isinstance(self._front[0].value, Line):
                self._enter(self._front[0].start, self._front[0].value)
        while self._ends and self._ends[0][0] < begin:
            self._ends.popleft()

    def _enter(self, moment: int, of: Value) -> None:
        """An end of a piece comes into the window."""
        if of is None:
            return
        value, ends = at(of, moment), self._ends
        while ends and (ends[-1][1] <= value if self._any else ends[-1][1] >= value):
            ends.pop()
        ends.append((moment, value))

    def _extreme(self, start: int, end: int) -> Found:
        parts: list[float | Line] = [self._ends[0][1]] if self._ends else []
        for piece, by in ((self._back[0], self._start), (self._front[0], self._end)):
            if isinstance(piece.value, Line):
                parts.append(piece.value.earlier(by))
            elif piece.value is not None:
                parts.append(piece.value)
        if Line not in map(type, parts):
            numbers: list[Any] = parts
            value = max(numbers, default=-math.inf) if self._any else min(numbers, default=math.inf)
            return [Piece(start, end, value)]
        found = [Piece(start, end, parts[0])]
        for part in parts[1:]:
            found = [
                each for piece in found for each in extreme(piece.start, piece.end, _value(piece), part, self._any)
            ]
        return found


def _value(piece: Piece) -> float | Line:
    assert piece.value is not None
    return piece.value


class Rest:
    """``always``, or ``eventually`` if ``any``, from ``start`` ns later to the end of the run."""

    __slots__ = ("_any", "_of", "_pieces", "_start")

    def __init__(self, any: bool, of: Operator, start: int) -> None:
        self._any = any
        self._of = of
        self._start = start
        self._pieces: Found = []

    def take(self, over: bool) -> Found:
        """See the module."""
        for piece in self._of.take(over):
            _append(self._pieces, piece)
        if not over or not self._pieces:
            return []
        pieces, self._pieces = self._pieces, []
        last = pieces[-1].end
        rest = -math.inf if self._any else math.inf
        backwards: Found = [Piece(last + 1, last + moment(self._start), rest)] if self._start else []
        for start, end, value in reversed(pieces):
            if isinstance(value, Line):
                is_falling = value.at(start) > value.at(end)
                # To its end it gets to what is there, or it is at its extreme from the start.
                ahead = value if is_falling == self._any else value.at(end)
                backwards += reversed(list(extreme(start, end, ahead, rest, self._any)))
                rest = at(_value(backwards[-1]), start)
            else:
                if value is not None:
                    rest = max(rest, value) if self._any else min(rest, value)
                backwards.append(Piece(start, end, rest))
        return list(earlier(reversed(backwards), self._start))


class Awaiting:
    """``until``, from ``start`` to ``end`` ns later; it becomes certain at the end of the run alone."""

    __slots__ = ("_end", "_left", "_left_of", "_right", "_right_of", "_start")

    def __init__(self, left: Operator, right: Operator, start: int, end: int | None) -> None:
        self._left_of = left
        self._right_of = right
        self._start = start
        self._end = end
        self._left: Found = []
        self._right: Found = []

    def take(self, over: bool) -> Found:
        """See the module."""
        # What there is nothing to judge in stands in nobody's way, and is not what was awaited.
        self._left += _filled(self._left_of.take(over), math.inf)
        self._right += _filled(self._right_of.take(over), -math.inf)
        if not over or not self._left:
            return []
        left, right, self._left, self._right = self._left, self._right, [], []
        last = left[-1].end
        low = self._after(left, _until(left, right, -math.inf), -math.inf)
        if self._end is None:
            return low
        # In a window that ends before the run does: what was awaited comes in it, and all is well until some time.
        found = Joining(False, Window(True, Source(right), self._start, self._end), Source(low)).take(True)
        sure_until = last - moment(self._end)
        whole = [each for each in found if each.start <= sure_until]
        if whole:
            whole[-1] = whole[-1]._replace(end=min(whole[-1].end, sure_until))
        # In one that is cut, what comes after the run may be what was awaited.
        high = self._after(left, _until(left, right, math.inf), math.inf)
        first = max(sure_until + 1, 0)
        sure, lost = deque(_parts(low, True)), deque(_parts(high, False))
        cut = [Piece(start, end, other if one is None else one) for start, end, one, other in overlaid(sure, lost)]
        return whole + [each._replace(start=max(each.start, first)) for each in cut if each.end >= first]

    def _after(self, left: Found, awaited: Found, beyond: float) -> Found:
        """What is awaited from ``start`` on, the left side being so until then; ``beyond`` is awaited after the end."""
        if self._start == 0:
            return awaited
        last = left[-1].end
        moved = [*earlier(awaited, self._start)]
        first = moved[-1].end + 1 if moved else 0
        held = Window(False, Source([*left, Piece(last + 1, last + moment(self._start), math.inf)]), 0, self._start - 1)
        tail = [Piece(first, last, beyond)] if first <= last else []
        both = Joining(False, held, Source([*moved, *tail]))
        return [each for each in both.take(False) if each.start <= last]


def _filled(pieces: Found, value: float) -> Found:
    return [each if each.value is not None else each._replace(value=value) for each in pieces]


def _parts(pieces: Found, positive: bool) -> Found:
    return [part for each in pieces for part in _deciding(*each, positive)]


def _until(left: Found, right: Found, beyond: float) -> Found:
    """``left until right`` from every moment on, what is awaited coming, or not, right after the end."""
    backwards: Found = []
    rest = beyond
    for start, end, one, other in reversed(list(overlaid(deque(left), deque(right)))):
        assert one is not None
        assert other is not None
        found = _until_on(start, end, one, other, rest)
        rest = at(_value(found[0]), start)
        backwards += reversed(found)
    return backwards[::-1]


def _until_on(start: int, end: int, left: float | Line, right: float | Line, rest: float) -> Found:
    """The solution of r(t) = max(right(t), min(left(t), r(t + 1))) on one piece, ``rest`` being r(end + 1)."""
    left_falls, right_falls = (at(each, start) > at(each, end) for each in (left, right))
    if not left_falls:
        best = rest if right_falls else max(at(right, end), rest)
        bounded = extreme(start, end, left, best, False)
        return [part for each in bounded for part in extreme(each.start, each.end, _value(each), right, True)]
    best = min(at(left, end), rest)
    if right_falls:
        return list(extreme(start, end, right, best, True))
    low, high = start, end + 1  # the first moment at which the right is above what the left was just before, if any
    while high - low > 1:
        middle = (low + high) // 2
        if at(right, middle) >= at(left, middle - 1):
            high = middle
        else:
            low = middle
    if high > end:
        return [Piece(start, end, max(at(right, end), best))]
    before = max(at(left, high - 1), at(right, high - 1), best)
    return [Piece(start, high - 1, before), *extreme(high, end, right, best, True)]


def operator_of(tree: Property, sources: Iterator[Source]) -> Operator:
    """The operators of a property; its conditions get the sources in their order."""
    match tree:
        case Not():
            return Negation(operator_of(tree.of, sources))
        case Junction():
            left = operator_of(tree.left, sources)
            return Joining(tree.any, left, operator_of(tree.right, sources))
        case Until():
            left = operator_of(tree.left, sources)
            return Awaiting(left, operator_of(tree.right, sources), tree.start, tree.end)
        case Quantified(end=None):
            return Rest(tree.any, operator_of(tree.of, sources), tree.start)
        case Quantified():
            assert tree.end is not None
            return Window(tree.any, operator_of(tree.of, sources), tree.start, tree.end)
        case _:
            return next(sources)
