"""Properties of several: ``for every drone[*], always drone[*].height >= 1 m``."""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from .syntax import MAX_LENGTH, PropertyError

_FOR: Final = re.compile(r"\s*for(?:\s+(\w+))?(?:\s+([^\s,:]+))?\s*[,:]?\s*")
EVERY, ANY = "every", "any"


class Spread(NamedTuple):
    """What every one, or any, of the places of a pattern is to have; ``offset`` is where the pattern is in the text."""

    any: bool
    pattern: str
    body: str
    offset: int

    def of(self, path: str) -> str:
        """The property of one place."""
        return _written(self.pattern).sub(lambda _: path, self.body)


def spread_of(source: str) -> Spread | None:
    """What a text says of several; None if it does not begin with 'for'.  Raises ``PropertyError``."""
    match = _FOR.match(source)
    if match is None or not re.match(r"\s*for\b", source):
        return None
    if len(source) > MAX_LENGTH:
        raise PropertyError(f"the property is longer than {MAX_LENGTH:,} characters", 0, len(source))
    example = f"write 'for {EVERY} robot[*], always robot[*].speed < 2 m/s', or 'for {ANY} ...'"
    quantifier, pattern, body = match[1], match[2], source[match.end() :]
    if quantifier not in (EVERY, ANY):
        at = match.start(1) if quantifier else 0
        said = f"'for {quantifier}' is not supported" if quantifier else "'for' says neither every nor any"
        raise PropertyError(said, at, len(quantifier or "for"), example)
    if not pattern or not body:
        raise PropertyError(f"'for {quantifier}' names {'no property' if pattern else 'no pattern'}", 0, 3, example)
    if not _written(pattern).search(body):
        message = f"the property does not name {pattern}, so it is the same for all"
        raise PropertyError(message, match.start(2), len(pattern), example)
    return Spread(quantifier == ANY, pattern, body, match.start(2))


def _written(pattern: str) -> re.Pattern[str]:
    """Where a property names the pattern itself, not a part of a longer name."""
    return re.compile(rf"(?<![\w.\]]){re.escape(pattern)}(?![\w\[])")
