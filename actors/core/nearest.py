"""The name that somebody probably meant: every message about an unknown name ends with it."""

from __future__ import annotations

import difflib
import heapq
import itertools
from collections.abc import Iterable

_MAX_NAME = 200  # comparing names takes quadratic time; nobody mistypes a name this long
_MAX_CANDIDATES = 2_000
_MAX_COMPARED = 100


def nearest(name: str, candidates: Iterable[str], likeness: float = 0.6) -> str | None:
    """Return the candidate that `name` was probably meant to be, or None if no one is near.

    `likeness`, from 0 to 1, is how near is near.
    """
    if len(name) > _MAX_NAME:
        return None
    by_folded: dict[str, str] = {}
    for candidate in itertools.islice(candidates, _MAX_CANDIDATES):
        if candidate != name and len(candidate) <= _MAX_NAME:
            by_folded.setdefault(candidate.casefold(), candidate)
    asked, likely = name.casefold(), list(by_folded)
    if len(likely) > _MAX_COMPARED:
        likely = heapq.nlargest(_MAX_COMPARED, likely, key=lambda each: _shared_ends(asked, each))
    found = difflib.get_close_matches(asked, likely, n=1, cutoff=likeness)
    return by_folded[found[0]] if found else None


def _shared_ends(one: str, other: str) -> int:
    """How many letters two names have in common at the start and at the end."""
    return _shared_start(one, other) + _shared_start(one[::-1], other[::-1])


def _shared_start(one: str, other: str) -> int:
    low, high = 0, min(len(one), len(other))
    while low < high:  # halved: letter by letter takes ten times as long
        middle = (low + high + 1) // 2
        if one[:middle] == other[:middle]:
            low = middle
        else:
            high = middle - 1
    return low


def did_you_mean(name: str, candidates: Iterable[str]) -> str:
    """Return ", did you mean 'x'?" for the nearest candidate x, or nothing; to end a message with."""
    found = nearest(name, candidates)
    return "" if found is None else f", did you mean {found!r}?"
