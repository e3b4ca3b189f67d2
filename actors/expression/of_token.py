"""Expressions over the fields of a token, and the parameters that hold them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ..core import REQUIRED, EpicycleError, brief, did_you_mean
from .formula import ExpressionParameter, Formula, as_text
from .tokens import operand
from .translation import UNDECIDED, translated, undecided_by


class TokenFormula:
    """A checked expression whose names are fields of a token, ``token`` itself, and further ``known`` names.

    Known names win over fields.  Calls are with a token and the values of the known names, in their order.  Raises
    ``ExpressionError`` if the text is not an expression.
    """

    __slots__ = ("_formula", "_function", "known", "source")

    def __init__(self, source: str, known: Sequence[str] = ()) -> None:
        self._formula = Formula(source)
        self.source = source
        self.known = tuple(known)
        self._function: Callable[..., Any] | None = None

    def __call__(self, token: Any, *known: Any) -> Any:
        """The value; raises ``EpicycleError``, also for a name that is neither known nor a field."""
        try:
            return (self._function or self._translated())(token, *known)
        except UNDECIDED:
            return self._decided(token, dict(zip(self.known, known, strict=True)))

    def _translated(self) -> Callable[..., Any]:
        arguments = ("" if "token" in self.known else "token", *self.known)  # a nameless one is in the way of none
        fields = tuple(name for name in self._formula.names if name not in arguments)
        self._function = translated(self.source, arguments, fields) or undecided_by
        return self._function

    def number(self, what: str, token: Any, *known: Any) -> float:
        """The value, which must be a finite number; ``what`` names it."""
        value = self(token, *known)
        if isinstance(value, (int, float)) and math.isfinite(value):
            return value
        raise EpicycleError(f"{self} gives {value!r}, but {what} must be a finite number")

    def _decided(self, token: Any, known: Mapping[str, Any]) -> Any:
        """The value by the evaluator."""
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
    known = token if isinstance(token, Mapping) else operand(token)
    if isinstance(known, Mapping) and name in known:
        return known[name]
    names = list(known) if isinstance(known, Mapping) else []
    near = did_you_mean(name, names) or ";"
    raise EpicycleError(f"the token {brief(known)} has no field {name!r}{near} it has {', '.join(names) or 'none'}")
