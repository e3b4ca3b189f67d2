"""Converts directors that fire all actors in iterations, such as SDF inside DE, to clocks and registers."""

from __future__ import annotations

from .directors import NUMBERS, fires_whole
from .entities import PARAMETER, Entity, Property, director_of
from .notes import Notes
from .scope import Scope
from .syntax import ExpressionError
from .table import row_of

MAX_AT_ONCE = 1000
_FIRST_LINK = 5_000_000  # after all links of the file
_DELAYS = {"SampleDelay": "initialOutputs", "NonStrictDelay": "initialValue", "Pre": "initialValue"}


def plain_iterations(model: Entity, notes: Notes) -> None:
    """Give each such composite a clock if it has a period, and replace its delays by registers."""
    waiting: list[tuple[Entity, Scope, Entity | None]] = [(model, Scope(model), None)]
    while waiting:
        composite, scope, outside = waiting.pop()
        waiting += [(child, Scope(child, scope), composite) for child in composite.entities.values()]
        director = director_of(composite)
        if director is None or not fires_whole(director):
            continue
        for child in composite.entities.values():
            if child.kind in _DELAYS:
                _register(child, Scope(child, scope))
        inner = Scope(director, scope, NUMBERS)
        said = [director.properties.pop(name, None) for name in ("period", "iterations")]
        try:
            period, count = (None if each is None else inner.value_of(each) for each in said)
            period, count = float(period or 0.0), -1 if count is None else int(count)  # -1 means one
        except (ExpressionError, TypeError, ValueError) as error:
            notes.error(f"{composite.name}.{director.name}: {error}")
            continue
        if outside is None:
            _run_whole(model, director, period, abs(count), notes)
        elif period:
            inputs = [name for name, port in composite.ports.items() if port.flag("input")]
            if any(outside.links.get(f"{composite.name}.{name}") for name in inputs):
                notes.note(f"{composite.name}.period = {period}: only in Ptolemy do tokens wait for the next iteration")
            _clock(composite, period)
        elif count > 1:
            notes.note(f"{composite.name}.{director.name}.iterations = {count}: only in Ptolemy does it stop then")


def _run_whole(model: Entity, director: Property, period: float, count: int, notes: Notes) -> None:
    """A model that consists only of iterations: the given number, all at one time or one in each period."""
    if count:
        director.properties.setdefault("stopTime", Property("stopTime", PARAMETER, repr((count - 1) * period)))
    if period or 0 < count <= MAX_AT_ONCE:
        _clock(model, period or 1.0, number=1 if period else count)
    else:
        notes.error(f"{model.name}: {count or 'endlessly many'} iterations at one time have no counterpart")


def _register(delay: Entity, scope: Scope) -> None:
    """A delay of one iteration: the input of the previous one, sent at the start of each."""
    name = _DELAYS[delay.kind]
    said = delay.properties.get(name)
    value = (said.value or "") if said is not None else "0" if name == "initialOutputs" else ""
    if said is not None and name == "initialOutputs":
        try:
            if len(scope.value_of(said)) != 1:
                return  # a delay of several iterations
        except (ExpressionError, TypeError):
            return
        value = f"({value})(0)"
    delay.properties.pop(name, None)
    delay.properties["initialValue"] = Property("initialValue", PARAMETER, value)
    delay.java = "ptolemy.domains.de.lib.Register"


def _clock(composite: Entity, period: float, *, number: int = 1) -> None:
    """Add a clock that triggers the actors that nothing triggers, ``number`` times at one time."""
    rows = {name: row_of(child.java) for name, child in composite.entities.items()}
    ports = [f"{name}.trigger" for name, row in rows.items() if row is not None and "trigger" in row.ports]
    ports = [port for port in ports if not composite.links.get(port)]
    if not ports:
        return
    name = "period"
    while name in composite.entities or name in composite.relations:
        name += "_"
    times, values = (f"{{{', '.join([each] * number)}}}" for each in ("0.0", "true"))
    said = {"period": repr(period), "offsets": times, "values": values}
    properties = {key: Property(key, PARAMETER, value) for key, value in said.items()}
    composite.entities[name] = Entity(name, "ptolemy.actor.lib.DiscreteClock", properties=properties)
    for order, port in enumerate([f"{name}.output", *ports], _FIRST_LINK):
        composite.link(name, order, port)
