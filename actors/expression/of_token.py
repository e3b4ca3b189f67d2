"""Expressions over the fields of a token, and the parameters that hold them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from types import FunctionType
from typing import Any

from ..core import REQUIRED, EpicycleError, brief, did_you_mean
from .formula import ExpressionParameter, Formula, as_text
from .tokens import operand
from .translation import translated_whole


class TokenFormula:
    """A checked expression whose names are fields of a token, ``token`` itself, and further ``known`` names.

    Known names win over fields.  Calls are with a token and the values of the known names, in their order.  Raises
    ``ExpressionError`` if the text is not an expression.
    """

    __slots__ = ("_formula", "call", "known", "number", "source")

    def __init__(self, source: str, known: Sequence[str] = ()) -> None:
        self._formula = Formula(source)
        self.source = source
        self.known = tuple(known)
        # The formula as a function, and as one of which the value must be a finite number; ``what`` names it.  They
        # are translated by their first call, for most copies of a model are never run.
        self.call: Callable[..., Any] = self._first_call
        self.number: Callable[..., float] = self._first_number

    def __call__(self, token: Any, *known: Any) -> Any:
        """The value; raises ``EpicycleError``, also for a name that is neither known nor a field."""
        return self.call(token, *known)

    def _first_call(self, token: Any, *known: Any) -> Any:
        self._translate()
        return self.call(token, *known)

    def _first_number(self, what: str, token: Any, *known: Any) -> float:
        self._translate()
        return self.number(what, token, *known)

    def _translate(self) -> None:
        arguments = ("" if "token" in self.known else "token", *self.known)  # a nameless one is in the way of none
        fields = tuple(name for name in self._formula.names if name not in arguments)
        self.call, self.number = self._decided, self._decided_number
        if (found := translated_whole(self.source, arguments, fields)) is not None:
            value, number = found
            self.call = FunctionType(value.__code__, value.__globals__, self.source, (self._decided,))
            rest = self._decided, self._refused
            self.number = FunctionType(number.__code__, number.__globals__, self.source, rest)

    def _decided_number(self, what: str, token: Any, *known: Any) -> float:
        return self._refused(what, self._decided(token, *known))

    def _refused(self, what: str, value: Any) -> float:
        if isinstance(value, (int, float)) and math.isfinite(value):
            return value
        raise EpicycleError(f"{self} gives {value!r}, but {what} must be a finite number")

    def _decided(self, token: Any, *given: Any) -> Any:
        """The value by the evaluator."""
        known = dict(zip(self.known, given, strict=True))
        seen = operand(token)
        fields: Mapping[str, Any] = seen if isinstance(seen, Mapping) else {}
        values = {}
        for name in self._formula.names:
            if name in known:
                values[name] = operand(known[name])
            elif name == "token":
                values[name] = seen
            elif name in fields:
                values[name] = fields[name]
            else:
                names = dict.fromkeys(["token", *known])
                near = did_you_mean(name, [*fields, *names]) or ";"
                what = f"it has {', '.join(fields) or 'none'}, and {', '.join(names)}"
                raise EpicycleError(
                    f"{self}: the token {brief(seen)} has no field {name!r}{near} {what} "
                    f"{'are' if len(names) > 1 else 'is'} known"
                )
        return self._formula.decided(values)

    def __reduce__(self) -> tuple[type[TokenFormula], tuple[str, tuple[str, ...]]]:
        return TokenFormula, (self.source, self.known)

    def __repr__(self) -> str:
        return repr(self.source)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, TokenFormula) and (other.source, other.known) == (self.source, self.known)

    def __hash__(self) -> int:
        return hash(self.source)


class TokenFormulaParameter(ExpressionParameter[TokenFormula]):
    """A parameter whose value is an expression over the fields of a token, ``token``, and the ``known`` names."""

    def __init__(self, default: Any = REQUIRED, *, known: Sequence[str] = (), doc: str = "") -> None:
        super().__init__(lambda text: TokenFormula(text, self.known), default, doc=doc)
        self.known = tuple(known)

    def convert(self, value: object) -> TokenFormula | None:
        if isinstance(value, (Formula, TokenFormula)):
            value = value.source
        return super().convert(as_text(value))


def field_of(token: Any, name: str) -> Any:
    """A field of a token, unchanged; raises ``EpicycleError`` if there is none with this name."""
    known = token if isinstance(token, (dict, Mapping)) else operand(token)  # dict, which is found sooner
    if isinstance(known, (dict, Mapping)) and name in known:
        return known[name]
    names = list(known) if isinstance(known, Mapping) else []
    near = did_you_mean(name, names) or ";"
    raise EpicycleError(f"the token {brief(known)} has no field {name!r}{near} it has {', '.join(names) or 'none'}")
