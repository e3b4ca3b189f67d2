"""Properties: what the text of a monitor says, as a tree.

Source of the operators and their robustness: Donze and Maler, Robust Satisfaction of Temporal Logic over Real-Valued
Signals, FORMATS 2010.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

from epicycle.actors import EpicycleError
from epicycle.actors.expression import PortFormula

from .signal import TINY

_HOLD: Final[dict[str, Callable[[Any, Any], bool]]] = {
    "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "==": operator.eq, "!=": operator.ne,
}  # fmt: skip
OPERATORS: Final = tuple(_HOLD)
_EXACT: Final = 2**53


@dataclass(frozen=True)
class Condition:
    """A comparison, a chain of them, or something else that is true or false, over what ports have sent last."""

    source: str
    whole: PortFormula
    sides: PortFormula  # a list of what is compared, or of the one thing that is true or false
    operators: tuple[str, ...]
    difference: PortFormula | None = None  # of the sides, if there are two that may be numbers
    units: tuple[str, ...] = ()  # of the numbers in it, which count in SI
    compared: tuple[str, ...] = ()  # of the sides that are just a number with a unit

    @property
    def references(self) -> tuple[str, ...]:
        """The ports, with fields, that it asks for."""
        return self.whole.references

    @property
    def zero(self) -> float:
        """What a margin of 0 becomes."""
        return TINY if self.operators[0] in ("<=", ">=") else -TINY

    def margin(self, values: Sequence[object]) -> float:
        """By how much it holds (above 0) or does not (below 0), for the values of its references.

        What cannot be subtracted holds, or does not, by infinity.  A margin of 0 becomes the smallest number on the
        side of the truth.  Raises ``EpicycleError``.
        """
        if self.difference is not None:
            try:  # as floats, in which whole numbers of this size are exact, for these are fast
                found = self.difference(
                    [float(each) if type(each) is int and -_EXACT <= each <= _EXACT else each for each in values]
                )
            except EpicycleError:  # of texts, say
                found = None
            if type(found) is float and found != 0.0:
                return found if self.operators[0][0] == ">" else -found
        try:
            sides: list[Any] = self.sides(values)
        except EpicycleError as error:
            self.whole(values)  # whose message people understand
            shown = ", ".join(f"{name} = {value!r}" for name, value in zip(self.references, values, strict=True))
            raise EpicycleError(f"{self.source!r} cannot be judged, with {shown}") from error
        if not self.operators:
            return math.inf if _truth(sides[0], self.source) else -math.inf
        pairs = zip(self.operators, sides, sides[1:], strict=False)
        return min(self._of_pair(sign, left, right) for sign, left, right in pairs)

    def _of_pair(self, sign: str, left: Any, right: Any) -> float:
        try:
            holds = bool(_HOLD[sign](left, right))
        except (TypeError, ValueError):
            raise EpicycleError(f"{self.source!r} cannot be judged: {left!r} {sign} {right!r}") from None
        if not (_is_number(left) and _is_number(right)) or math.isinf(left) or math.isinf(right):
            return math.inf if holds else -math.inf
        if math.isnan(left) or math.isnan(right):
            raise EpicycleError(f"{self.source!r} cannot be judged: {left!r} {sign} {right!r}")
        gap = abs(float(left) - float(right)) or TINY
        return gap if holds else -gap


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _truth(value: object, source: str) -> bool:
    if isinstance(value, (bool, int, float)):
        return bool(value)
    raise EpicycleError(f"{source!r} is neither true nor false: it is {value!r}")


@dataclass(frozen=True)
class Sends:
    """True at the instants at which a port sends something."""

    port: str


@dataclass(frozen=True)
class Not:
    """True where something is not."""

    of: Property


@dataclass(frozen=True)
class Junction:
    """``and``, or with ``any`` ``or``, of two properties."""

    any: bool
    left: Property
    right: Property


@dataclass(frozen=True)
class Quantified:
    """``always``, or with ``any`` ``eventually``: from ``start`` to ``end`` ns later, or at all later times."""

    any: bool
    of: Property
    start: int = 0
    end: int | None = None


@dataclass(frozen=True)
class Until:
    """``left`` holds until ``right`` does, between ``start`` and ``end`` ns later."""

    left: Property
    right: Property
    start: int = 0
    end: int | None = None


Property: TypeAlias = Condition | Sends | Not | Junction | Quantified | Until


def looks_ahead(tree: Property) -> bool:
    """Whether more than the present decides when it breaks: it is not ``always`` of something that is only of now."""
    match tree:
        case Junction():
            return looks_ahead(tree.left) or looks_ahead(tree.right)
        case Quantified(any=False):
            return not _is_of_now(tree.of)
        case _:
            return True


def waits_for_tokens(tree: Property) -> bool:
    """Whether it breaks only when a token comes, not as time goes on."""
    match tree:
        case Junction():
            return waits_for_tokens(tree.left) and waits_for_tokens(tree.right)
        case Quantified(any=False, start=0):
            return _is_of_now(tree.of) and all(isinstance(each, Condition) for each in leaves(tree))
        case _:
            return False


def _is_of_now(tree: Property) -> bool:
    match tree:
        case Not():
            return _is_of_now(tree.of)
        case Junction():
            return _is_of_now(tree.left) and _is_of_now(tree.right)
        case _:
            return isinstance(tree, (Condition, Sends))


def leaves(tree: Property) -> list[Condition | Sends]:
    """Its conditions, in the order in which they were written."""
    match tree:
        case Not() | Quantified():
            return leaves(tree.of)
        case Junction() | Until():
            return leaves(tree.left) + leaves(tree.right)
        case _:
            return [tree]
