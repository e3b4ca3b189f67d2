"""Converts directors: which of them fire by the rules of DE, and which settings they keep."""

from __future__ import annotations

import math
from typing import Any

from .actors import is_layout, plain, seconds
from .entities import Entity, Property, kind
from .notes import Notes
from .reasons import why_not
from .scope import Scope
from .syntax import ExpressionError

_DE_LIKE = frozenset({"DEDirector", "DECQDirector"})
_FIRED_WHOLE = frozenset({
    "SDFDirector", "SROnceDirector", "SRDirector", "DDFDirector", "HDFDirector", "PSDFDirector", "FSMDirector",
    "MultirateFSMDirector", "TMDirector", "GiottoDirector",
})  # fmt: skip
_IN_ITERATIONS = frozenset({"SDFDirector", "SRDirector", "SROnceDirector"})  # which a clock can start, even at the top
NUMBERS = {"AUTO": -1, "UNBOUNDED": 0}  # Ptolemy's names for numbers of iterations
_WITHOUT_EFFECT = frozenset({
    "binCountFactor", "isCQAdaptive", "minBinCount", "maskImpliedFirings", "timeResolution", "verbose",
    "allowDisconnectedGraphs", "allowRateChanges", "vectorizationFactor", "stopWhenQueueIsEmpty", "seed",
    "constrainBufferSizes", "enforceMicrostepSemantics", "SuppressWarnings", "period", "AUTO", "UNBOUNDED",
})  # fmt: skip
_IN_REAL_TIME = frozenset({"synchronizeToRealTime", "timeScale", "realTime"})


def director_of(entity: Entity) -> Property | None:
    """The composite's own director, if it has one."""
    found = [each for each in entity.properties.values() if kind(each).endswith("Director") and not is_layout(each)]
    return found[-1] if found else None


def fires_whole(director: Property) -> bool:
    """Whether it fires all actors in each iteration, even those that nothing triggers."""
    return kind(director) in _FIRED_WHOLE


def said_of(director: Property, path: str, around: Scope, notes: Notes, *, of_model: bool) -> dict[str, Any]:
    """The settings of a director, including its stop time in s."""
    found: dict[str, Any] = {}
    scope = Scope(director, around, NUMBERS)
    if fires_whole(director) and (not of_model or kind(director) in _IN_ITERATIONS):
        notes.note(f"{path}, a {kind(director)}: the actors inside fire by the rules of DE")
    elif kind(director) not in _DE_LIKE:
        notes.error(f"{path} is a {director.java}, which has no counterpart{why_not(director.java)}")
    for name, said in director.properties.items():
        if is_layout(said) or name in _WITHOUT_EFFECT:
            continue
        try:
            if name == "localClock" and said.text("clockDrift"):
                found |= _drift(scope.value(said.text("clockDrift") or ""))
            elif (
                said.value is not None and said.value.strip() and not _note(name, scope.value_of(said), found, of_model)
            ):
                end = "run it with --realtime" if name in _IN_REAL_TIME else "has no counterpart"
                notes.note(f"{path}.{name} = {said.value!r}: {end}")
        except (ExpressionError, ValueError, TypeError) as error:
            notes.note(f"{path}.{name} = {said.value!r}: {error}")
    return found


def _drift(value: Any) -> dict[str, Any]:
    return {} if value == 1.0 else {"drift": plain(value)}


def _note(name: str, value: Any, found: dict[str, Any], of_model: bool) -> bool:
    """Store a parameter of a director; return whether it has a counterpart."""
    if name == "startTime":
        found |= {"start": seconds(value)} if value else {}
    elif name == "stopTime":
        found |= {} if value is None or math.isinf(value) or value > 1e300 else {"stop": float(value)}
    elif name == "clockDrift":
        found |= _drift(value)
    elif name == "iterations":
        return of_model or value in (-1, 0, 1)
    else:
        return value is False
    return True
