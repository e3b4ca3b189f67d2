"""Converts directors that fire all actors in iterations, such as SDF inside DE, to clocks and registers."""

from __future__ import annotations

from .directors import NUMBERS, director_of, fires_whole
from .entities import Entity, Link, Property, Relation, kind
from .notes import Notes
from .scope import Scope
from .syntax import ExpressionError
from .table import counterpart_of

_PARAMETER = "ptolemy.data.expr.Parameter"
_REGISTER = "ptolemy.domains.de.lib.Register"
MAX_AT_ONCE = 1000
_DELAYS = {"SampleDelay": "initialOutputs", "NonStrictDelay": "initialValue", "Pre": "initialValue"}


def plain_iterations(model: Entity, notes: Notes) -> None:
    """Give each such composite a clock if it has a period, and replace its delays by registers."""
    waiting: list[tuple[Entity, Scope | None, Entity | None]] = [(model, None, None)]
    while waiting:
        composite, around, outside = waiting.pop()
        scope = Scope(model) if around is None else around.inside(composite)
        waiting += [(child, scope, composite) for child in composite.entities.values()]
        director = director_of(composite)
        if director is None or not fires_whole(director):
            continue
        for child in composite.entities.values():
            if kind(child) in _DELAYS:
                _register(child, scope.inside(child))
        inner = Scope(director, scope, NUMBERS)
        try:
            period, count = (_number(director.properties.pop(name, None), inner) for name in ("period", "iterations"))
        except (ExpressionError, TypeError, ValueError) as error:
            notes.error(f"{composite.name}.{director.name}: {error}")
            continue
        if outside is None:
            _run_whole(model, period, -1 if count is None else int(count), notes)
        elif period:
            is_fed = any(
                port.flag("input") and outside.links.get(f"{composite.name}.{port.name}")
                for port in composite.ports.values()
            )
            if is_fed:
                notes.note(f"{composite.name}.period = {period}: only in Ptolemy do tokens wait for the next iteration")
            _clock(composite, period)
        elif count is not None and count > 1:
            notes.note(f"{composite.name}.{director.name}.iterations = {count:g}: only in Ptolemy does it stop then")


def _number(said: Property | None, scope: Scope) -> float | None:
    """The value of a number parameter; None if it is not set."""
    value = None if said is None else scope.value_of(said)
    return None if value is None else float(value)


def _run_whole(model: Entity, period: float | None, count: int, notes: Notes) -> None:
    """A model that consists only of iterations: the given number, all at one time or one in each period."""
    count = abs(count)  # -1 means one
    if count and (director := director_of(model)) is not None:
        end = repr((count - 1) * (period or 0.0))
        director.properties.setdefault("stopTime", Property("stopTime", _PARAMETER, end))
    if period:
        _clock(model, period)
    elif 0 < count <= MAX_AT_ONCE:
        _clock(model, 1.0, number=count)
    else:
        notes.error(f"{model.name}: {count or 'endlessly many'} iterations at one time have no counterpart")


def _register(delay: Entity, scope: Scope) -> None:
    """A delay of one iteration: the input of the previous one, sent at the start of each."""
    name = _DELAYS[kind(delay)]
    said = delay.properties.pop(name, None)
    value = "" if said is None else said.value or ""
    if name == "initialOutputs":
        try:
            initial = [0] if said is None else scope.value_of(said)
        except ExpressionError:
            initial = None
        if said is not None and (not isinstance(initial, list) or len(initial) != 1):
            delay.properties[name] = said
            return  # a delay of several iterations
        value = f"({value})(0)" if said is not None else "0"
    delay.properties["initialValue"] = Property("initialValue", _PARAMETER, value, delay.line)
    delay.java = _REGISTER


def _clock(composite: Entity, period: float, *, number: int = 1) -> None:
    """Add a clock that triggers the actors that nothing triggers, ``number`` times at one time."""
    name = relation = "period"
    while name in composite.entities:
        name += "_"
    while relation in composite.relations:
        relation += "_"
    triggers = [
        f"{child.name}.trigger"
        for child in composite.entities.values()
        if (row := counterpart_of(child.java)) is not None
        and "trigger" in row.ports
        and not composite.links.get(f"{child.name}.trigger")
    ]
    if not triggers:
        return
    said = {"period": repr(period), "offsets": f"{{{', '.join(['0.0'] * number)}}}", "values": "{true}"}
    if number > 1:
        said["values"] = f"{{{', '.join(['true'] * number)}}}"
    composite.entities[name] = Entity(
        name,
        "ptolemy.actor.lib.DiscreteClock",
        properties={key: Property(key, _PARAMETER, v) for key, v in said.items()},
    )
    composite.relations[relation] = Relation(relation)
    for order, port in enumerate([f"{name}.output", *triggers], 5_000_000):
        composite.links.setdefault(port, []).append(Link(port, relation, composite.line, order))
