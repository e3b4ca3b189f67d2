"""Monitors of properties: whether a property holds from the beginning of a run, as soon as that is certain."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

from .operators import Operator, Source, operator_of
from .property import Junction, Not, Property, Quantified, leaves
from .signal import Line, Piece, at, by_sign, moment


class PropertyVerdict(NamedTuple):
    """Whether a property holds (None if that cannot be told), by how much, and the moment at which it broke first."""

    holds: bool | None = None
    robustness: float | None = None
    moment: int | None = None


class PropertyMonitor:
    """Takes in the conditions of a property, as pieces of ``sources`` in their order."""

    __slots__ = ("_root", "sources")

    def __init__(self, tree: Property) -> None:
        self.sources = [Source() for _ in leaves(tree)]
        self._root = _root(tree, iter(self.sources))

    def verdict(self, over: bool) -> PropertyVerdict:
        """What is certain by now; with ``over``, nothing comes after this."""
        return self._root.verdict(over)

    @property
    def most(self) -> float:
        """What the robustness is at most, by what is certain since the last ``verdict``; infinity if nothing is."""
        return self._root.most


class _Throughout:
    """``always``, or ``eventually`` if ``any``, at the beginning."""

    __slots__ = ("_any", "_end", "_extreme", "_is_whole", "_known", "_moment", "_of", "_start")

    def __init__(self, tree: Quantified, of: Operator) -> None:
        self._any = tree.any
        self._of = of
        self._start = moment(tree.start)
        self._end = None if tree.end is None else moment(tree.end + 1) - 1  # with all samples of that instant
        self._extreme = -math.inf if tree.any else math.inf
        self._known = -1
        self._moment: int | None = None  # when it was decided
        self._is_whole = False

    @property
    def most(self) -> float:
        """See ``PropertyMonitor``; a later moment may still be the one that is awaited."""
        return math.inf if self._any and not self._is_whole else self._extreme

    def verdict(self, over: bool) -> PropertyVerdict:
        for piece in self._of.take(over):
            self._known = piece.end
            start = max(piece.start, self._start)
            end = piece.end if self._end is None else min(piece.end, self._end)
            if piece.value is not None and start <= end:
                self._add(start, end, piece.value)
        is_decided = self._moment is not None
        self._is_whole = over if self._end is None else self._known >= self._end
        if not (is_decided or self._is_whole):
            return PropertyVerdict()
        holds = self._any == is_decided
        when = self._moment if not self._any else self._known if self._end is None else self._end
        return PropertyVerdict(holds, self._extreme, None if holds else when)

    def _add(self, start: int, end: int, value: float | Line) -> None:
        both = (self._extreme, at(value, start), at(value, end))
        self._extreme = max(both) if self._any else min(both)
        if self._moment is None and (isinstance(value, Line) or (value > 0.0) == self._any):
            deciding = (each.start for each in by_sign(start, end, value) if (at(value, each.start) > 0.0) == self._any)
            self._moment = next(deciding, None)


class _Both:
    """``and``, or ``or`` if ``any``, at the beginning."""

    __slots__ = ("_any", "_left", "_right")

    def __init__(self, any: bool, left: _Root, right: _Root) -> None:
        self._any = any
        self._left = left
        self._right = right

    @property
    def most(self) -> float:
        """See ``PropertyMonitor``."""
        both = self._left.most, self._right.most
        return max(both) if self._any else min(both)

    def verdict(self, over: bool) -> PropertyVerdict:
        both = self._left.verdict(over), self._right.verdict(over)
        deciding = [each for each in both if each.holds == self._any]
        found = deciding or ([] if None in (both[0].holds, both[1].holds) else both)
        if not found:
            return PropertyVerdict()
        margins = [each.robustness for each in found if each.robustness is not None]
        moments = [each.moment for each in found if each.moment is not None]
        when = None if not moments else max(moments) if self._any else min(moments)
        return PropertyVerdict(found[0].holds, max(margins) if self._any else min(margins), when)


class _Once:
    """Anything else, at the beginning; it becomes certain when its own value there does."""

    __slots__ = ("_first", "_of")

    def __init__(self, of: Operator) -> None:
        self._of = of
        self._first: Piece | None = None

    @property
    def most(self) -> float:
        """See ``PropertyMonitor``."""
        value = None if self._first is None else self._first.value
        return math.inf if value is None else at(value, 0)

    def verdict(self, over: bool) -> PropertyVerdict:
        found = self._of.take(over)
        if found and self._first is None:
            self._first = found[0]
        value = None if self._first is None else self._first.value
        if value is None:
            return PropertyVerdict()
        margin = at(value, 0)
        return PropertyVerdict(margin > 0.0, margin, None)


_Root = _Throughout | _Both | _Once


def _root(tree: Property, sources: Iterator[Source]) -> _Root:
    match tree:
        case Not(of=Not() as of):
            return _root(of.of, sources)
        case Not(of=Junction() as of):
            return _root(Junction(not of.any, Not(of.left), Not(of.right)), sources)
        case Not(of=Quantified() as of):
            return _root(Quantified(not of.any, Not(of.of), of.start, of.end), sources)
        case Junction():
            left = _root(tree.left, sources)
            return _Both(tree.any, left, _root(tree.right, sources))
        case Quantified():
            return _Throughout(tree, operator_of(tree.of, sources))
        case _:
            return _Once(operator_of(tree, sources))
