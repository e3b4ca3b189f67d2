"""The smallest set that does something, of the things that may have a part in it."""

from __future__ import annotations

from collections.abc import Callable, Container, Hashable, Iterable, Iterator, Sequence
from functools import partial
from itertools import pairwise
from typing import TypeVar

T = TypeVar("T", bound=Hashable)


def minimal(
    things: Sequence[T],
    breaks: Callable[[frozenset[T]], bool],
    active: Callable[[frozenset[T]], Container[T]] = lambda some: some,
    expect: Callable[[Iterable[frozenset[T]]], None] = lambda sets: None,
) -> list[T]:
    """A part of the ``things`` that ``breaks``, and does not without any single one of them; in their order.

    ``breaks`` must hold of all of them, and not of none.  It need not be monotone, so another such part may be smaller.
    Of a part that breaks, ``active`` names those that probably had a part in it: they are tried alone.
    ``expect`` is told what ``breaks`` will be asked next, in this order, until it holds.
    Source: ddmin of Zeller and Hildebrandt, Simplifying and Isolating Failure-Inducing Input, IEEE TSE 28, 2002.
    """

    def without_idle(part: list[T]) -> list[T]:
        at_work = active(frozenset(part))
        fewer = [each for each in part if each in at_work]
        return fewer if 0 < len(fewer) < len(part) and breaks(frozenset(fewer)) else part

    def first(parts: Callable[[], Iterable[list[T]]]) -> list[T] | None:
        expect(map(frozenset, parts()))
        return next((each for each in parts() if breaks(frozenset(each))), None)

    left, number = without_idle(list(things)), 2
    while len(left) > 1:
        number = min(number, len(left))
        bounds = [len(left) * each // number for each in range(number + 1)]
        pieces = [left[start:end] for start, end in pairwise(bounds)]
        if (piece := first(partial(iter, pieces))) is not None:
            left, number = without_idle(piece), 2
            continue

        def rests(pieces: list[list[T]] = pieces) -> Iterator[list[T]]:
            return ([each for other in pieces if other is not piece for each in other] for piece in pieces)

        # Of two pieces, each is the rest of the other.
        if number > 2 and (rest := first(rests)) is not None:
            left, number = without_idle(rest), max(number - 1, 2)
        elif number == len(left):
            return left
        else:
            number *= 2
    return left
