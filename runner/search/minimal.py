"""The smallest set that does something, of the things that may have a part in it."""

from __future__ import annotations

from collections.abc import Callable, Container, Hashable, Iterable, Iterator, Sequence
from itertools import chain, pairwise
from typing import TypeVar

T = TypeVar("T", bound=Hashable)


def minimal(
    things: Sequence[T],
    breaks: Callable[[frozenset[T]], bool],
    active: Callable[[frozenset[T]], Container[T]] = lambda some: some,
    expect: Callable[[Iterable[frozenset[T]], Sequence[T]], None] = lambda sets, answer: None,
) -> list[T]:
    """A part of the ``things`` that ``breaks``, and does not without any single one of them; in their order.

    ``breaks`` must hold of all of them, and not of none.  It need not be monotone, so another such part may be smaller.
    Of a part that breaks, ``active`` names those that probably had a part in it: they are tried alone.
    ``expect`` is told what ``breaks`` is asked next, in this order, until it holds, and the answer if it never does.
    Source: ddmin of Zeller and Hildebrandt, Simplifying and Isolating Failure-Inducing Input, IEEE TSE 28, 2002.
    """
    left, number = list(things), 2
    while True:
        at_work = active(frozenset(left))
        fewer = [each for each in left if each in at_work]
        if 0 < len(fewer) < len(left):
            # It probably breaks, too, and then its parts are tried.
            expect(map(frozenset, chain([fewer], parts(fewer, number))), fewer)
            left = fewer if breaks(frozenset(fewer)) else left
        expect(map(frozenset, parts(left, number)), left)
        broken = next((each for each in _parts(left, number) if breaks(frozenset(each[0]))), None)
        if broken is None:
            return left
        left, number = broken


def parts(left: list[T], number: int = 2) -> Iterator[list[T]]:
    """What is tried of a part that breaks, in this order, until one of them does."""
    return (part for part, _ in _parts(left, number))


def _parts(left: list[T], number: int) -> Iterator[tuple[list[T], int]]:
    """What is tried of a part that breaks: so many pieces, what is left without each of them, and then more pieces.

    With each comes in how many pieces it is divided if it breaks.
    """
    while len(left) > 1:
        number = min(number, len(left))
        bounds = [len(left) * each // number for each in range(number + 1)]
        pieces = list(pairwise(bounds))
        yield from ((left[start:end], 2) for start, end in pieces)
        if number > 2:  # of two pieces, each is the rest of the other
            yield from (([*left[:start], *left[end:]], max(number - 1, 2)) for start, end in pieces)
        if number == len(left):
            return
        number *= 2
