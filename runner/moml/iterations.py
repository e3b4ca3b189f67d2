"""Directors that fire all in iterations, such as SDF's inside of DE: clocks and delays that go by these."""

from __future__ import annotations

from .directors import director_of, fires_whole
from .entities import Entity, Link, Property, Relation, kind
from .notes import Notes
from .scope import Scope
from .syntax import ExpressionError
from .table import counterpart_of

_PARAMETER = "ptolemy.data.expr.Parameter"
_REGISTER = "ptolemy.domains.de.lib.Register"
_DELAYS = {"SampleDelay": "initialOutputs", "NonStrictDelay": "initialValue", "Pre": "initialValue"}


def plain_iterations(model: Entity, notes: Notes) -> None:
    """Give each such composite a clock if it has a period, and for delays what sends in each iteration."""
    waiting = [(child, Scope(model), model) for child in model.entities.values()]
    while waiting:
        composite, around, outside = waiting.pop()
        scope = around.inside(composite)
        waiting += [(child, scope, composite) for child in composite.entities.values()]
        director = director_of(composite)
        if director is None or not fires_whole(director):
            continue
        for child in composite.entities.values():
            if kind(child) in _DELAYS:
                _register(child, scope.inside(child))
        if (said := director.properties.pop("period", None)) is not None:
            is_fed = any(
                port.flag("input") and outside.links.get(f"{composite.name}.{port.name}")
                for port in composite.ports.values()
            )
            _period(composite, Scope(director, scope), said, notes, is_fed=is_fed)


def _register(delay: Entity, scope: Scope) -> None:
    """A delay of one iteration: what came in the one before, sent at the begin of each."""
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
            return  # of several iterations
        value = f"({value})(0)" if said is not None else "0"
    delay.properties["initialValue"] = Property("initialValue", _PARAMETER, value, delay.line)
    delay.java = _REGISTER


def _period(composite: Entity, scope: Scope, said: Property, notes: Notes, *, is_fed: bool) -> None:
    try:
        period = scope.value_of(said)
    except ExpressionError as error:
        notes.note(f"{composite.name}.period = {said.value!r}: {error}")
        return
    if isinstance(period, (int, float)) and period > 0:
        if is_fed:
            notes.note(f"{composite.name}.period = {period}: there, what comes waits for the next iteration")
        _clock(composite, period)


def _clock(composite: Entity, period: float) -> None:
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
    said = {"period": repr(float(period)), "offsets": "{0.0}", "values": "{true}"}
    composite.entities[name] = Entity(
        name,
        "ptolemy.actor.lib.DiscreteClock",
        properties={key: Property(key, _PARAMETER, v) for key, v in said.items()},
    )
    composite.relations[relation] = Relation(relation)
    for number, port in enumerate([f"{name}.output", *triggers]):
        composite.links.setdefault(port, []).append(Link(port, relation, composite.line, 5_000_000 + number))
