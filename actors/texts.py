"""Actors on texts: TextFunction."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from .core import Actor, EpicycleError, Latest, OutputPort, Parameter, PortParameter, counted

MAX_TEXT = 100_000
FUNCTIONS: Final[dict[str, Callable[[str, str, str], Any]]] = {
    "lower": lambda text, other, new: text.lower(),
    "upper": lambda text, other, new: text.upper(),
    "trim": lambda text, other, new: text.strip(),
    "equals": lambda text, other, new: text == other,
    "contains": lambda text, other, new: other in text,
    "starts with": lambda text, other, new: text.startswith(other),
    "ends with": lambda text, other, new: text.endswith(other),
    "find": lambda text, other, new: text.find(other),
    "find last": lambda text, other, new: text.rfind(other),
    "replace": lambda text, other, new: text.replace(other, new),
    "replace first": lambda text, other, new: text.replace(other, new, 1),
    "split": lambda text, other, new: text.split(other) if other else text.split(),
}
_TYPES: Final[dict[str, Any]] = {
    **dict.fromkeys(("equals", "contains", "starts with", "ends with"), bool),
    **dict.fromkeys(("find", "find last"), int),
    "split": list,
}
_CUTTING: Final = ("replace", "replace first", "split")
_COMPARING: Final = tuple(name for name in _TYPES if name not in _CUTTING)


class TextFunction(Actor):
    """Applies a function to texts whenever one of its inputs gets a token; each input keeps its latest token.

    ``lower``, ``upper`` and ``trim`` use only ``text``.  ``equals``, ``contains``, ``starts with`` and ``ends with``
    compare it with ``other``; ``find`` and ``find last`` send the position of ``other`` in it, from 0, or -1.
    ``replace`` and ``replace first`` replace ``other`` by ``new``, ``split`` gives the parts between occurrences.
    Ptolemy: ``StringCompare``, ``StringFunction``, ``StringIndexOf``, ``StringMatches`` and ``StringReplace`` of plain
    texts.
    """

    output: OutputPort[Any] = OutputPort(str, doc="the result")

    function = Parameter(str, choices=tuple(FUNCTIONS), doc="the function to apply")
    ignore_case = Parameter(bool, False, doc="whether upper and lower case are the same, in both texts")
    text = PortParameter(str, "", doc="the text")
    other = PortParameter(str, "", doc="text to compare with, or to find")
    new = PortParameter(str, "", doc="replacement for the text found")

    def check(self) -> None:
        self.output.type = _TYPES.get(self.function, str)

    def initialize(self) -> None:
        start = {"text": self.text, "other": self.other, "new": self.new}
        self._latest = Latest([self.inputs[name] for name in start], hold=True, start=start)

    def fire(self) -> None:
        for values in self._latest.rounds():
            text, other, new = map(self._checked, values.values())
            if self.ignore_case:
                other = _folded(other)
                if self.function in _COMPARING:
                    text = _folded(text)
                elif self.function in _CUTTING and other:
                    text = _respelled(text, other)
            if self.function.startswith("replace") and other and text.count(other) * len(new) > MAX_TEXT:
                raise EpicycleError(f"the result is longer than {counted(MAX_TEXT, 'character')}")
            self.output.send(FUNCTIONS[self.function](text, other, new))

    def _checked(self, token: Any) -> str:
        if not isinstance(token, str):
            raise EpicycleError(f"{token!r} is not a text")
        if len(token) > MAX_TEXT:
            raise EpicycleError(f"the text is longer than {counted(MAX_TEXT, 'character')}")
        return token


def _folded(text: str) -> str:
    """A text in lower case, of the same length: the lower case of a few letters is longer, and they stay."""
    return "".join(low if len(low := letter.lower()) == 1 else letter for letter in text)


def _respelled(text: str, folded: str) -> str:
    """A text in which another is spelled as here wherever it occurs; all else keeps its case."""
    parts, end = [], 0
    for part in _folded(text).split(folded):
        parts.append(text[end : end + len(part)])
        end += len(part) + len(folded)
    return folded.join(parts)
