"""Dotted patterns over paths: ``observer[*].sensor.range``, ``*.peer_plan``, ``**.measurement``.

``*`` matches one whole segment of a path, ``name[*]`` every instance of an array, ``**`` any number of segments.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Iterator
from functools import cached_property, lru_cache

from epicycle.actors import FaultError, nearest, paths

from .limits import NORMAL, Limits

_SEGMENT = re.compile(r"(\*\*|(\*|[A-Za-z_][A-Za-z0-9_]*)(\[(\*|\d{1,9})\])?)\Z")

_INDEX = re.compile(r"\[\d+\]")
MAX_PATTERN = 1_000
_MANY = 5  # how often all paths are scanned before they are indexed by their names
MAX_SHOWN = 12  # names in a message


class PatternError(FaultError, ValueError):
    """Text that is not a pattern; the message says why."""


class TooManyError(Exception):
    """There are too many patterns and paths to compare in a short time."""


class Comparisons:
    """How many paths patterns may still be compared with; raises ``TooManyError``."""

    def __init__(self, most: int) -> None:
        self._most = self._left = most

    def spend(self, number: int) -> None:
        self._left -= number
        if self._left < 0:
            raise TooManyError(f"patterns are compared with more than {self._most:,} paths")


def in_general(path: str) -> str:
    """``a[*].b`` for ``a[2].b``: a message about one instance covers all of them."""
    return _INDEX.sub("[*]", path)


def folded(paths: Iterable[str]) -> list[str]:
    """Paths for people: those of replicas as one, such as ``robot[*].delivered (20)``, with their number."""
    groups: dict[str, list[str]] = {}
    for path in paths:
        groups.setdefault(in_general(path), []).append(path)
    return [each[0] if len(each) == 1 else f"{general} ({len(each)})" for general, each in groups.items()]


def names_asked(pattern: str) -> list[str]:
    """The segments of a pattern that a path must have: ``s[3]``, ``s[*]`` or ``s``."""
    return [segment for segment in pattern.split(".") if not segment.startswith("*")]


def names_of(path: str) -> set[str]:
    """Everything in one path that ``names_asked`` of a pattern may contain."""
    names = set(path.split("."))
    return names | {f"{name[: name.index('[')]}[*]" for name in names if name[-1:] == "]"}


@lru_cache(maxsize=4096)
def compile_pattern(text: str) -> re.Pattern[str]:
    """The regular expression of a pattern; raises ``PatternError``."""
    check_pattern(text)
    # What is between two `**` matches at the first possible place, and that is final (?>...): a later place would give
    # no more matches, but could take for ever.
    head, *tails = ("".join(map(_expression, part.split(".")[:-1])) for part in f"{text}.".split("**."))
    expression = head + "".join(rf"(?>(?:[^.]*\.)+?{tail})" for tail in tails[:-1])
    if tails:
        expression += rf"(?:[^.]*\.)+{tails[-1]}"
    # Every segment includes its dot; the path gets one more to match, and that of the model is nothing else.
    return re.compile(expression)


def _expression(segment: str) -> str:
    """The regular expression of a segment that is not ``**``, and of the dot after it."""
    return (r"[^.]*" if segment[0] == "*" else re.escape(segment).replace(r"\[\*\]", r"\[\d+\]")) + r"\."


def check_pattern(text: str) -> None:
    """Raise ``PatternError`` if a text is not a pattern."""
    if len(text) > MAX_PATTERN:
        raise PatternError(f"a pattern has at most {MAX_PATTERN:,} characters")
    for segment in text.split("."):
        if not _SEGMENT.match(segment):
            raise PatternError(f"{segment!r} is not a name, a name with an index, '*' or '**'")


def matches(pattern: str, path: str) -> bool:
    """Whether a pattern selects the path."""
    return compile_pattern(pattern).fullmatch(f"{path}.") is not None


def could_be_within(pattern: str, path: str, *, array: bool) -> bool:
    """Whether a pattern could match something below a path without an index, if there were anything.

    With ``array``, the pattern must give an index there.
    """
    asked, parts = pattern.split("."), path.split(".")
    for position, segment in enumerate(asked[: len(parts)]):
        if segment == "**":
            return True
        name, bracket, _ = segment.partition("[")
        is_last = position == len(parts) - 1
        if segment != "*" and (name != parts[position].partition("[")[0] or (array and is_last and not bracket)):
            return False
    return len(asked) > len(parts)


def select(pattern: str, paths: Iterable[str]) -> list[str]:
    """The paths that the pattern selects, in their order."""
    return PathIndex(paths).select(pattern)


def _always(_: str) -> bool:
    return True


class PathIndex:
    """Paths from which patterns select without checking each of them: a model may have many of both.

    ``limits`` are those of the model: patterns that must be compared with too many paths raise ``TooManyError``.
    """

    def __init__(self, paths: Iterable[str], limits: Limits = NORMAL) -> None:
        self._place = {path: place for place, path in enumerate(paths)}
        self._comparisons = Comparisons(limits.comparisons)
        self._compared = 0

    def __iter__(self) -> Iterator[str]:
        return iter(self._place)

    def __contains__(self, path: object) -> bool:
        return path in self._place

    def select(self, pattern: str) -> list[str]:
        """The paths that the pattern selects, in their order; raises ``PatternError``."""
        check_pattern(pattern)
        if "*" not in pattern:
            return [pattern] if pattern in self._place else []
        # At the first wildcard, `name[*]` still gives the name.
        fixed = pattern.partition("*")[0].rstrip("[.")
        candidates: Collection[str] = self._within.get(fixed, ()) if fixed else self._place.keys()
        # Selecting by the names in a pattern pays if there are many patterns.
        if self._compared > _MANY * len(self._place):
            others = [self._having.get(name, ()) for name in names_asked(pattern)]
            candidates = min(candidates, *others, key=len) if others else candidates
        self._compared += len(candidates)
        self.spend(len(candidates))
        expression = compile_pattern(pattern)
        return [path for path in candidates if expression.fullmatch(f"{path}.")]

    def in_order(self, paths: Iterable[str]) -> list[str]:
        """The given paths in their order here."""
        return sorted(paths, key=self._place.__getitem__)

    def near(self, pattern: str, scope: str = "", fits: Callable[[str], bool] = _always) -> tuple[str, Iterable[str]]:
        """A pattern without matches, and the paths that fit, of which it may mean one: for ``Problems.add``."""
        near: Iterable[str] = (paths.relative(path, scope) for path in self.inside(scope) if fits(path))
        if "[*]" in pattern:
            near = dict.fromkeys(map(in_general, near))
        return pattern, near

    def advice(self, pattern: str, scope: str = "", fits: Callable[[str], bool] = _always) -> tuple[str, ...]:
        """What to write instead of a pattern without matches: the ports at the place that it names."""
        if len(paths.join(scope, pattern)) + 2 > MAX_PATTERN:
            return ()
        for holder in (pattern, paths.parent(pattern)):
            ports = [path for path in self.select(paths.join(scope, f"{holder}.*")) if fits(path)] if holder else []
            names = list(dict.fromkeys(map(paths.name, ports)))
            if names and holder == pattern:
                written = ", ".join(f"{pattern}.{name}" for name in names)
                return (f"that is an actor, not a port: write {written}",)
            if names:
                return (f"valid ports of {holder}: {', '.join(names)}",)
        if nearest(*self.near(pattern, scope, fits)):
            return ()
        firsts = (paths.relative(path, scope).partition(".")[0] for path in self.inside(scope) if fits(path))
        holders = list(dict.fromkeys(map(in_general, firsts)))
        if not holders:
            return ("there is no suitable port",)
        more = ", ..." if len(holders) > MAX_SHOWN else ""
        return (f"there are suitable ports at {', '.join(holders[:MAX_SHOWN])}{more}",)

    def spend(self, number: int) -> None:
        """Count paths that are scanned for another reason; raises ``TooManyError`` if there are too many."""
        self._comparisons.spend(number)

    def inside(self, scope: str) -> Collection[str]:
        """The paths within a composite; all of them if it is the model."""
        return self._within.get(scope, ()) if scope else self._place.keys()

    @cached_property
    def _having(self) -> dict[str, list[str]]:
        """The paths by the names in them."""
        found: dict[str, list[str]] = {}
        for path in self._place:
            for name in names_of(path):
                found.setdefault(name, []).append(path)
        return found

    @cached_property
    def _within(self) -> dict[str, list[str]]:
        """The paths by what they begin with: whole segments, the last one also without its index."""
        found: dict[str, list[str]] = {}
        for path in self._place:
            end = len(path)
            while (end := path.rfind(".", 0, end)) > 0:
                found.setdefault(path[:end], []).append(path)
                if path[end - 1] == "]":
                    found.setdefault(path[: path.rindex("[", 0, end)], []).append(path)
            if path.endswith("]"):  # the model itself has an empty path
                found.setdefault(path[: path.rindex("[")], []).append(path)
        return found
