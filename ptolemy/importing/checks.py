"""Converts the checks of a model: Test and NonStrictTest."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from .actors import plain
from .syntax import ExpressionError

if TYPE_CHECKING:
    from .actors import Actor


def strict_test(actor: Actor) -> None:
    """A Test: expected values, on one channel or on several together."""
    _test(actor, strict=True)


def non_strict_test(actor: Actor) -> None:
    """A NonStrictTest: expected values, token by token."""
    _test(actor, strict=False)


def _test(actor: Actor, *, strict: bool) -> None:
    if _shared(actor, "trainingMode") is True:
        actor.notes.note(f"{actor.path} is in training mode and checks nothing")
        _records(actor)
        return
    complete = _shared(actor, "requireAllCorrectValues")
    if isinstance(complete, bool):
        actor.values["complete"] = complete
    said = actor.said("correctValues")
    actor.told.add("correctValues")
    try:
        values = [True] if said is None else actor.scope.value_of(said)
        written = plain(_without_nan(values if isinstance(values, list) else [values]))
    except (ExpressionError, ValueError) as error:
        actor.notes.note(f"{actor.path} checks nothing: correctValues: {error}")
        _records(actor)
        return
    assert isinstance(written, list)
    width = actor.widths.get("input", 1)
    if strict and width > 1 and written and all(type(each) is list for each in values):
        actor.values["together"] = True
    elif strict and width == 1:  # an array holds the values of all channels, here of one
        written = [each[0] if type(each) is list and len(each) == 1 else each for each in written]
    actor.values = {"values": written, **actor.values}


def _without_nan(value: Any) -> Any:
    """Expected values with None for NaN, which any number matches."""
    if isinstance(value, list):
        return [_without_nan(each) for each in value]
    if isinstance(value, dict):
        return {name: _without_nan(each) for name, each in value.items()}
    return None if isinstance(value, float) and math.isnan(value) else value


def _shared(actor: Actor, name: str) -> object:
    """A parameter that all actors of a class share: the last one in the file sets it for all."""
    actor.told.add(name)
    top = actor.scope
    while top.around is not None:
        top = top.around
    for said in reversed(top.set_by_class.get((actor.entity.java, name), [])):
        try:
            return actor.scope.value_of(said)
        except ExpressionError as error:
            actor.notes.note(f"{actor.path}.{name} = {said.value!r}: {error}")
    return None


def _records(actor: Actor) -> None:
    actor.values = {"type": "Recorder"}
    actor.told |= {*actor.row.parameters, "correctValues"}
