"""Decisions: LogicGate, Comparator, Equals."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

from .core import ABSENT, Actor, EpicycleError, InputPort, Latest, OutputPort, Parameter, any_parameter, present, rounds
from .expression import operand

GATES: Final[dict[str, Callable[[list[bool]], bool]]] = {
    "and": all,
    "or": any,
    "xor": lambda inputs: sum(inputs) % 2 == 1,
    "nand": lambda inputs: not all(inputs),
    "nor": lambda inputs: not any(inputs),
    "xnor": lambda inputs: sum(inputs) % 2 == 0,
}


class LogicGate(Actor):
    """Combines truth values: and, or, xor (an odd number is true), and their negations nand, nor, xnor.

    ``not`` is ``nor`` of one input.  Channels without a token at this tag are ignored, unless ``hold`` is set.
    Ptolemy: ``LogicFunction``, ``LogicalNot``.
    """

    input = InputPort(bool, multi=True, doc="the truth values")
    output = OutputPort(bool, doc="their combination")

    function = Parameter(str, choices=(*GATES, "not"), doc="how truth values are combined")
    hold = Parameter(bool, False, doc="whether a channel without a token is used with its latest one")

    def initialize(self) -> None:
        self._held: list[Any] = []

    def fire(self) -> None:
        gate = GATES["nor" if self.function == "not" else self.function]
        for (tokens,) in rounds(self.input):
            if self.hold:
                before = self._held or tokens
                tokens = [old if new is ABSENT else new for old, new in zip(before, tokens, strict=True)]
                self._held = tokens
            self.output.send(gate([bool(token) for token in present(tokens)]))


def _equal(left: Any, right: Any, tolerance: float) -> bool:
    return bool(left == right) if tolerance == 0 else bool(right - tolerance <= left <= right + tolerance)


COMPARISONS: Final[dict[str, Callable[[Any, Any, float], bool]]] = {
    "==": _equal,
    "!=": lambda left, right, tolerance: not _equal(left, right, tolerance),
    "<": lambda left, right, tolerance: bool(left < (right + tolerance if tolerance else right)),
    "<=": lambda left, right, tolerance: bool(left <= (right + tolerance if tolerance else right)),
    ">": lambda left, right, tolerance: bool((left + tolerance if tolerance else left) > right),
    ">=": lambda left, right, tolerance: bool((left + tolerance if tolerance else left) >= right),
}


class Comparator(Actor):
    """Compares ``left`` with ``right``, or with ``value`` if nothing is connected to ``right``.

    A tolerance relaxes the comparison: ``left >= right`` holds down to ``right - tolerance``.  Ptolemy:
    ``Comparator``.
    """

    left: InputPort[Any] = InputPort(float | bool | str, doc="the left side")
    right: InputPort[Any] = InputPort(float | bool | str, required=False, doc="the right side")
    output = OutputPort(bool, doc="whether the comparison holds")

    comparison = Parameter(str, choices=tuple(COMPARISONS), doc="which comparison")
    value = any_parameter(0, doc="the right side if that port is not connected")
    tolerance = Parameter(float, 0.0, min=0, doc="largest difference of numbers that still count as equal")
    hold = Parameter(bool, True, doc="whether an input without a token is used with its latest one")

    def initialize(self) -> None:
        self._latest = Latest([self.left, self.right], hold=self.hold)

    def fire(self) -> None:
        compare = COMPARISONS[self.comparison]
        for values in self._latest.rounds():
            left, right = values["left"], values.get("right", self.value)
            try:
                holds = compare(left, right, self.tolerance)
            except TypeError:
                how = f"{self.comparison}, with a tolerance" if self.tolerance else self.comparison
                raise EpicycleError(f"{left!r} and {right!r} cannot be compared by {how}") from None
            self.output.send(holds)


class Equals(Actor):
    """Sends whether all tokens that come together are equal; channels without a token are ignored.

    Ptolemy: ``Equals``.
    """

    input = InputPort(multi=True, doc="the tokens to compare")
    output = OutputPort(bool, doc="whether all are equal")

    tolerance = Parameter(
        float, 0.0, min=0, doc="largest difference of numbers, also in lists and fields, from the first token"
    )

    def fire(self) -> None:
        for (tokens,) in rounds(self.input):
            first, *others = present(tokens)
            self.output.send(all(alike(other, first, self.tolerance) for other in others))


def alike(token: Any, other: Any, tolerance: float) -> bool:
    """Whether tokens are equal except that numbers may differ by a tolerance; lists and fields are compared item by
    item."""
    token, other = operand(token), operand(other)
    if isinstance(token, list) and isinstance(other, list):
        return len(token) == len(other) and all(map(alike, token, other, [tolerance] * len(token)))
    if isinstance(token, Mapping) and isinstance(other, Mapping):
        return token.keys() == other.keys() and all(alike(token[key], other[key], tolerance) for key in token)
    if isinstance(token, bool) or isinstance(other, bool):
        return token is other
    if isinstance(token, (int, float)) and isinstance(other, (int, float)):
        return token == other or abs(token - other) <= tolerance
    return bool(token == other)
