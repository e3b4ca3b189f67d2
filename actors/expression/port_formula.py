"""PortFormula: an expression over what ports have sent last, such as ``main.state.position[0] < 20``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ..core import REQUIRED, EpicycleError, Parameter, ParameterError
from .formula import Formula, operand
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
    ``main.state.position``.  A name in ``given`` stands for itself: its value, of which fields can be named as well,
    comes with each call; ``given_fields`` are those, as ``("token.speed", ("speed",))``.  Raises ``ExpressionError`` if
    the text is no such expression.
    """

    __slots__ = ("_formula", "_given", "_paths", "_ports", "given_fields", "references", "source")

    def __init__(self, source: str, given: Sequence[str] = ()) -> None:
        names: dict[str, str] = {}

        def stand_in(match: re.Match[str]) -> str:
            path = match["path"]
            return match[0] if path is None else names.setdefault(path, f"port_{len(names)}")

        self._formula = Formula(_REFERENCE.sub(stand_in, source))
        self._paths = tuple(names)
        for name in self._formula.names:
            if name in given:
                names[name] = name
            elif name not in names.values():
                also = "".join(f", and {each!r} is known" for each in given)
                raise ExpressionError(f"the name {name!r} is unknown: a port is written 'actor.port'{also}")
        if not names:
            what = " or ".join([*map(repr, given), "a port as 'actor.port'"])
            raise ExpressionError(f"{'nothing' if given else 'no port'} is named in it: write {what}")
        self.source = source
        self._ports = {path: name for path, name in names.items() if path.split(".")[0] not in given}
        self._given = {name: path.split(".") for path, name in names.items() if path not in self._ports}
        self.references = tuple(self._ports)
        self.given_fields = tuple((".".join(path), tuple(path[1:])) for path in self._given.values() if path[1:])

    def __call__(self, values: Sequence[object], **given: object) -> Any:
        """The value for those of the references, in their order, and of the given names; raises ``EpicycleError``."""
        known = dict(zip(self._ports.values(), values, strict=True))
        for name, (root, *fields) in self._given.items():
            known[name] = operand(value_at(given[root], fields))
        try:
            return self._formula(known)
        except EpicycleError as error:
            told = _STAND_IN.sub(lambda match: self._paths[int(match[1])], str(error))
            raise EpicycleError(told) from None

    def __repr__(self) -> str:
        return repr(self.source)


def value_at(token: Any, fields: Iterable[str]) -> Any:
    """A part of a token; None where there is no such part."""
    for name in fields:
        token = token.get(name) if isinstance(token, Mapping) else getattr(token, name, None)
    return token


class PortFormulaParameter(Parameter[PortFormula | None]):
    """A parameter whose value is an expression over ports, and over the ``given`` names."""

    def __init__(self, default: Any = REQUIRED, *, given: Sequence[str] = (), doc: str = "") -> None:
        super().__init__(str, default, doc=doc)  # type: ignore[arg-type]
        self.given = tuple(given)

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
            return PortFormula(value, self.given)
        except ExpressionError as error:
            raise ParameterError(f"{value!r} is not an expression over ports: {error}") from None
