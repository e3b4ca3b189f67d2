"""PortFormula: an expression over what ports have sent last, such as ``main.state.position[0] < 20``."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from ..core import REQUIRED, EpicycleError, Parameter, ParameterError
from .formula import Formula
from .syntax import ExpressionError

# Dotted names with an index only where another name follows: a last index is a subscript of the token.
_REFERENCE = re.compile(
    r"""(?P<text>"[^"]*"|'[^']*')"""
    r"""|(?<![\w.])(?P<path>[A-Za-z_]\w*(?:\[\d+\](?=\.))?(?:\.[A-Za-z_]\w*(?:\[\d+\](?=\.[A-Za-z_]))?)+)""",
    re.ASCII,
)
_STAND_IN = re.compile(r"\bport_(\d+)\b", re.ASCII)


class PortFormula:
    """A checked expression in which dotted names stand for tokens: ``references``, in the order of their appearance.

    A reference is the path of an output port, with the fields that lead to a part of its token: ``main.state`` or
    ``main.state.position``.  Raises ``ExpressionError`` if the text is no such expression.
    """

    __slots__ = ("_formula", "_names", "references", "source")

    def __init__(self, source: str) -> None:
        names: dict[str, str] = {}

        def stand_in(match: re.Match[str]) -> str:
            path = match["path"]
            return match[0] if path is None else names.setdefault(path, f"port_{len(names)}")

        self._formula = Formula(_REFERENCE.sub(stand_in, source))
        for name in self._formula.names:
            if name not in names.values():
                raise ExpressionError(f"the name {name!r} is unknown: a port is written 'actor.port'")
        if not names:
            raise ExpressionError("no port is named in it: write a port as 'actor.port'")
        self.source = source
        self.references = tuple(names)
        self._names = tuple(names.values())

    def __call__(self, values: Sequence[object]) -> Any:
        """The value for those of the references, in their order; raises ``EpicycleError``."""
        try:
            return self._formula(dict(zip(self._names, values, strict=True)))
        except EpicycleError as error:
            told = _STAND_IN.sub(lambda match: self.references[int(match[1])], str(error))
            raise EpicycleError(told) from None

    def __repr__(self) -> str:
        return repr(self.source)


class PortFormulaParameter(Parameter[PortFormula | None]):
    """A parameter whose value is an expression over ports."""

    def __init__(self, default: Any = REQUIRED, *, doc: str = "") -> None:
        super().__init__(str, default, doc=doc)  # type: ignore[arg-type]

    def describe_type(self) -> str:
        return "expression over ports"

    def convert(self, value: object) -> PortFormula | None:
        if value is None and self.optional:
            return None
        if isinstance(value, PortFormula):
            return value
        if not isinstance(value, str):
            raise ParameterError(f"{value!r} is not an expression over ports")
        try:
            return PortFormula(value)
        except ExpressionError as error:
            raise ParameterError(f"{value!r} is not an expression over ports: {error}") from None
