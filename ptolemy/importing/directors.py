"""Converts directors: which of them fire by the rules of DE, and which settings they keep."""

from __future__ import annotations

import math
from typing import Any

from .entities import Property, is_layout
from .notes import Notes
from .scope import Scope
from .syntax import ExpressionError
from .tables import WORDS, why_not
from .translation import Code
from .writing import plain, seconds

NUMBERS = {"AUTO": -1, "UNBOUNDED": 0}  # Ptolemy's names for numbers of iterations


def fires_whole(director: Property) -> bool:
    """Whether it fires all actors in each iteration, even those that nothing triggers."""
    return director.kind in WORDS["directors that fire whole"]


def needs_word(director: Property) -> bool:
    """Whether a model with this director can only be imported as one of DE."""
    return director.kind in WORDS["directors in iterations"]


def said_of(director: Property, path: str, around: Scope, notes: Notes, *, of_model: bool = False) -> dict[str, Any]:
    """The settings of a director, including its stop time in s."""
    found: dict[str, Any] = {}
    scope = Scope(director, around, NUMBERS)
    if fires_whole(director) and (not of_model or needs_word(director)):
        notes.note(f"{path}, a {director.kind}: the actors inside fire by the rules of DE")
    elif director.kind not in WORDS["directors like DE"]:
        notes.error(f"{path} is a {director.java}, which has no counterpart{why_not(director.java)}")
    for name, said in director.properties.items():
        if is_layout(said) or name in WORDS["settings without effect"]:
            continue
        try:
            if name == "localClock":
                for drift in (said.properties.get(each) for each in ("clockDrift", "clockRate")):
                    if drift is not None:
                        _note("clockDrift", Scope(said, scope).value_of(drift), found, of_model)
                        if isinstance(Scope(said, scope).meaning_of(drift), Code):
                            notes.note(f"{path}.{name}.{drift.name} = {drift.value!r} keeps its initial value")
            elif (said.value or "").strip() and not _note(name, scope.value_of(said), found, of_model):
                end = "run it with --realtime" if name in WORDS["settings in real time"] else "has no counterpart"
                notes.note(f"{path}.{name} = {said.value!r}: {end}")
        except (ExpressionError, ValueError, TypeError) as error:
            notes.note(f"{path}.{name} = {said.value!r}: {error}")
    return found


def _note(name: str, value: Any, found: dict[str, Any], of_model: bool) -> bool:
    """Store a parameter of a director; return whether it has a counterpart."""
    if name == "startTime":
        found |= {"start": seconds(value)} if value else {}
    elif name == "stopTime":
        found |= {} if value is None or math.isinf(value) or value > 1e300 else {"stop": float(value)}
    elif name == "clockDrift":
        found |= {} if value == 1.0 else {"drift": plain(value)}
    elif name == "iterations":
        return of_model or value in (-1, 0, 1)
    else:
        return value is False
    return True
