"""The parts of messages: values, numbers and names in readable form, and the name that was probably meant.

Texts from models, data and foreign code pass through here before they appear in a message or on a terminal: no terminal
obeys them, nothing in them is invisible, and they have a reasonable length.
"""

from __future__ import annotations

import hashlib
import heapq
import itertools
from collections.abc import Callable, Iterable

import numpy as np

LONGEST = 2_000  # characters of a line of a message
_TAIL = 300
_BRIEF = 60
_MAX_NAME = 200  # comparing names takes quadratic time, and longer names are not typing errors
_MAX_CANDIDATES = 2_000
_MAX_COMPARED = 100


def digits(number: float) -> str:
    """A number as people write it: whole numbers without an exponent, unless that is too long to read."""
    in_full = float(number).is_integer() and abs(number) < (10**20 if type(number) is int else 1e15)
    return str(int(number)) if in_full else f"{float(number):g}"


def brief(value: object) -> str:
    """A value as Python writes it, or as YAML does where that differs; cut if it is long."""
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, int) and value.bit_length() > 10_000:  # which Python does not write
        return "a number of more than 3,000 digits"
    text = repr(value.tolist() if isinstance(value, np.ndarray) else value)
    return f"{text[: _BRIEF - 4]}...'" if len(text) > _BRIEF and isinstance(value, str) else cut(text)


def cut(text: str) -> str:
    """A text within a line, of reasonable length."""
    return text if len(text) <= _BRIEF else f"{text[: _BRIEF - 3]}..."


def counted(number: int, noun: str) -> str:
    """A number with the noun it counts: `0 ports`, `1 port`, `2,000 ports`."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def visible(text: str) -> str:
    """A line in which everything that a terminal would obey or hide is written as an escape."""
    return text if text.isprintable() else "".join(map(visible_character, text))


def visible_character(character: str) -> str:
    """One character in the same way: as it is, or as an escape."""
    return character if character.isprintable() else character.encode("unicode_escape").decode("ascii")


def visible_lines(text: str) -> str:
    """Text of several lines, each of them visible."""
    return text if text.isprintable() else "\n".join(map(visible, text.split("\n")))


def shortened(text: str, longest: int = LONGEST) -> str:
    """A line of reasonable length: its beginning, how much was left out, and its end."""
    if len(text) <= longest:
        return text
    tail = min(_TAIL, longest // 4)
    return f"{text[: longest - tail]} ... ({len(text) - longest:,} characters left out) ... {text[-tail:]}"


def abridged(name: str, longest: int) -> str:
    """A short name unchanged; of a long one its beginning and a mark, so that two with the same beginning stay
    different."""
    if len(name) <= longest:
        return name
    mark = hashlib.sha256(name.encode("utf-8", "surrogatepass")).hexdigest()[:6]
    return f"{name[: longest - 9]}...{mark}"


def readable(text: str) -> str:
    """Text of several lines for a message: each line visible and of reasonable length."""
    if len(text) <= LONGEST and text.isprintable():
        return text
    return "\n".join(visible(shortened(line)) for line in text.split("\n"))


def nearest(name: str, candidates: Iterable[str], likeness: float = 0.6) -> str | None:
    """The candidate that `name` was probably meant to be, or None if none is near.

    `likeness`, from 0 to 1, is the threshold.
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
    import difflib  # here, as most names are right

    found = difflib.get_close_matches(asked, likely, n=1, cutoff=likeness)
    return by_folded[found[0]] if found else None


def _shared_ends(one: str, other: str) -> int:
    """The number of letters that two names have in common at the start and at the end."""
    return _shared_start(one, other) + _shared_start(one[::-1], other[::-1])


def _shared_start(one: str, other: str) -> int:
    low, high = 0, min(len(one), len(other))
    while low < high:  # by halving: letter by letter takes ten times as long
        middle = (low + high + 1) // 2
        if one[:middle] == other[:middle]:
            low = middle
        else:
            high = middle - 1
    return low


def did_you_mean(name: str, candidates: Iterable[str]) -> str:
    """ ", did you mean 'x'?" for the nearest candidate x, or nothing; for the end of a message."""
    found = nearest(name, candidates)
    return "" if found is None else f", did you mean {found!r}?"


def bounds_text(least: float | None, above: float | None, most: float | None, written: Callable[[float], str]) -> str:
    """The bounds of a number as they are written after it: `` >= 0``, `` > 0 and <= 1``."""
    ends = ((">=", least), (">", above), ("<=", most))
    told = " and ".join(f"{sign} {written(end)}" for sign, end in ends if end is not None)
    return f" {told}" if told else ""
