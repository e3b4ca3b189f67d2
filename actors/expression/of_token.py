"""Expressions over the fields of a token."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from ..core import EpicycleError, brief, did_you_mean
from .formula import Formula, operand


def of_token(formula: Formula, token: Any, /, **known: Any) -> Any:
    """The value of an expression whose names are fields of a token.

    ``token`` is the whole token, and ``known`` are further names, which win over fields.  Raises ``EpicycleError`` for
    a name that is neither.
    """
    if not formula.names:
        return formula({})
    seen = operand(token)
    fields: Mapping[str, Any] = seen if isinstance(seen, Mapping) else {}
    values = {}
    for name in formula.names:
        if name in known:
            values[name] = known[name]
        elif name == "token":
            values[name] = seen
        elif name in fields:
            values[name] = fields[name]
        else:
            names = dict.fromkeys(["token", *known])
            near = did_you_mean(name, [*fields, *names]) or ";"
            what = f"it has {', '.join(fields) or 'none'}, and {', '.join(names)}"
            raise EpicycleError(
                f"{formula}: the token {brief(seen)} has no field {name!r}{near} {what} "
                f"{'are' if len(names) > 1 else 'is'} known"
            )
    return formula(values)


def field_of(token: Any, name: str) -> Any:
    """A field of a token, unchanged; raises ``EpicycleError`` if there is none with this name."""
    known = token if isinstance(token, Mapping) else operand(token)
    names = list(known) if isinstance(known, Mapping) else []
    if name not in names:
        near = did_you_mean(name, names) or ";"
        raise EpicycleError(f"the token {brief(known)} has no field {name!r}{near} it has {', '.join(names) or 'none'}")
    return known[name]


def number_of_token(formula: Formula, what: str, token: Any, /, **known: Any) -> float:
    """The same for a finite number; ``what`` names it."""
    value = of_token(formula, token, **known)
    if isinstance(value, (int, float)) and math.isfinite(value):
        return value
    raise EpicycleError(f"{formula} gives {value!r}, but {what} must be a finite number")
