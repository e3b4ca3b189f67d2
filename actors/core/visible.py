"""Text that people are shown: nothing in it is obeyed by a terminal or hides, and there is never too much of it.

What models, data and the code of others say comes through here before it stands in a message or on a terminal.
"""

from __future__ import annotations

import hashlib

LONGEST = 2_000  # characters of a line of a message
_TAIL = 300


def visible(text: str) -> str:
    """A line with everything that a terminal would obey or hide written as an escape."""
    return text if text.isprintable() else "".join(map(visible_character, text))


def visible_character(character: str) -> str:
    """One character in the same way: itself, or an escape."""
    return character if character.isprintable() else character.encode("unicode_escape").decode("ascii")


def visible_lines(text: str) -> str:
    """Text of several lines, each of them visible."""
    return text if text.isprintable() else "\n".join(map(visible, text.split("\n")))


def shortened(text: str, longest: int = LONGEST) -> str:
    """A line of bearable length: its beginning and its end, and how much was left out between them."""
    if len(text) <= longest:
        return text
    tail = min(_TAIL, longest // 4)
    return f"{text[: longest - tail]} ... ({len(text) - longest:,} characters left out) ... {text[-tail:]}"


def abridged(name: str, longest: int) -> str:
    """A name as it is if it is short, or else its beginning and a mark: two that begin alike stay two."""
    if len(name) <= longest:
        return name
    mark = hashlib.sha256(name.encode("utf-8", "surrogatepass")).hexdigest()[:6]
    return f"{name[: longest - 9]}...{mark}"


def readable(text: str) -> str:
    """Text of several lines as it stands in a message: each of them visible and of bearable length."""
    if len(text) <= LONGEST and text.isprintable():
        return text
    return "\n".join(visible(shortened(line)) for line in text.split("\n"))
