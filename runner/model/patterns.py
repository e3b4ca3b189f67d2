"""Dotted patterns over paths: ``observer[*].sensor.range``, ``*.peer_plan``, ``**.measurement``.

``*`` stands for one whole segment of a path, ``name[*]`` for every instance of an array, ``**`` for any number of
segments.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import lru_cache

_SEGMENT = re.compile(r"(\*\*|\*|[A-Za-z_][A-Za-z0-9_]*)(\[(\*|\d{1,9})\])?\Z")


class PatternError(ValueError):
    """Text that is no pattern; the message says why."""


@lru_cache(maxsize=4096)
def compile_pattern(text: str) -> re.Pattern[str]:
    """The regular expression of a pattern; raises ``PatternError``."""
    if len(text) > 1000:
        raise PatternError("a pattern has at most 1,000 characters")
    parts = []
    for segment in text.split("."):
        match = _SEGMENT.match(segment)
        if match is None:
            raise PatternError(f"{segment!r} is not a name, a name with an index, '*' or '**'")
        name, index = match.group(1), match.group(3)
        if name == "**":
            parts.append(r"(?:[^.]+\.)*[^.]+")
        elif name == "*":
            parts.append(r"[^.]+")
        elif index is None:
            parts.append(re.escape(name))
        else:
            parts.append(re.escape(name) + (r"\[\d+\]" if index == "*" else re.escape(f"[{index}]")))
    return re.compile(r"\.".join(parts) + r"\Z")


def matches(pattern: str, path: str) -> bool:
    """Whether the pattern selects the path."""
    return compile_pattern(pattern).match(path) is not None


def could_be_within(pattern: str, path: str, *, array: bool) -> bool:
    """Whether a pattern may speak of something behind a path without an index, were there anything.

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
    expression = compile_pattern(pattern)
    return [path for path in paths if expression.match(path)]
