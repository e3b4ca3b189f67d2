"""Converts aspects: the settings that Ptolemy's decorators keep at the ports and actors where they are enabled."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from .document import Property, is_aside
from .limits import Notes
from .parts import ASPECT_MODELS, Part, is_enabled
from .scope import Scope
from .syntax import ExpressionError
from .table import table, why_not
from .writing import Flow, plain, seconds

_BUSES = ("Bus", "AtomicCommunicationAspect")
_POLICIES = table("words")["schedulers"]


@dataclass
class Place:
    """A port or actor at which an aspect is enabled, and the aspect's settings there."""

    path: str  # as patterns name it
    said: Property
    scope: Scope
    is_port: bool

    def value(self, name: str, default: Any = None) -> Any:
        """A setting; its expression may use the other settings."""
        said = self.said.properties.get(name)
        found = None if said is None else Scope(self.said, self.scope).value_of(said)
        return default if found is None else found


Made = list[tuple[float | None, str, Flow]]  # the sequence number if it is at ports, the name, the entry
_Entry = Callable[[Part], Flow]  # writes an aspect that is a model


def aspects_of(part: Part, entry: _Entry, notes: Notes) -> dict[str, Flow]:
    """The aspects that a composite declares, in the order in which a token meets them."""
    found: dict[str, Flow] = {}
    aspects = [each for each in part.parts.values() if each.role == "aspect"]
    places: dict[str, list[Place]] = {}
    for place in _places(part, "") if aspects else ():
        places.setdefault((place.said.text("decoratorName") or "").rpartition(".")[2], []).append(place)
    made: Made = []
    for each in aspects:
        what, here = f"{each.path}, a {each.entity.java},", places.get(each.entity.name, [])
        try:
            if not here:
                notes.note(f"{what} is not enabled anywhere and is left out")
            elif each.entity.kind in _BUSES:
                made += _bus(each, here, notes)
            elif each.entity.kind in _POLICIES:
                made += _scheduler(each, here, notes)
            elif each.entity.kind in ASPECT_MODELS:
                made += _model(each, here, entry)
            else:
                notes.error(f"{each.path} is a {each.entity.java}, which has no counterpart{why_not(each.entity.java)}")
        except (ExpressionError, ValueError, TypeError) as error:
            notes.error(f"{each.path}: {error}")
    # Aspects at ports follow their sequence numbers; they share the positions that they have among the others.
    at_ports = iter(sorted((each for each in made if each[0] is not None), key=lambda each: each[0] or 0.0))
    for sequence, name, said in made:
        if sequence is not None:
            _, name, said = next(at_ports)
        found[name] = said
    return found


def _places(part: Part, prefix: str) -> Iterator[Place]:
    """The ports and actors inside at which aspects are enabled."""
    for child in part.parts.values():
        if child.entry is None:
            continue
        path = f"{prefix}{child.name}"
        owners: dict[str, Property] = {path: child.entity}
        owners |= {f"{path}.{child.port_name(name)}": port for name, port in child.entity.ports.items()}
        for where, owner in owners.items():
            enabled = [said for said in owner.properties.values() if is_enabled(said)]
            yield from (Place(where, said, child.scope, owner is not child.entity) for said in enabled)
        yield from _places(child, f"{path}.")


def _sequence(places: list[Place]) -> float | None:
    return min((float(each.value("sequenceNumber", 0)) for each in places if each.is_port), default=None)


def _at(places: list[Any]) -> Any:
    return places[0] if len(places) == 1 else places


def _settings(part: Part, notes: Notes, *names: str) -> dict[str, Any]:
    """The values of parameters of an aspect, if it has some; others are reported."""
    found: dict[str, Any] = {}
    for name, said in part.entity.properties.items():
        if name in names:
            found[name] = part.scope.value_of(said)
        elif name != "justMonitor" and not is_aside(said) and said.value is not None:
            notes.note(f"{part.told(name)} = {said.value!r} has no counterpart")
    return {name: value for name in names if (value := found.get(name)) is not None}


def _bus(part: Part, places: list[Place], notes: Notes) -> Made:
    """A declaration for each message length and sequence number; all of them share one medium."""
    names = part.around.names
    name, factor = names.of(part.entity.name), 0.1
    for value in _settings(part, notes, "serviceTimeMultiplicationFactor", "serviceTime").values():
        factor = value
    groups: dict[tuple[float, float], list[Place]] = {}
    for place in places:
        key = float(place.value("sequenceNumber", 0)), float(place.value("messageLength", 1))
        groups.setdefault(key, []).append(place)
    made: Made = []
    for number, ((sequence, length), here) in enumerate(groups.items()):
        entry = Flow({"type": "Bus", **({"medium": name} if len(groups) > 1 else {}), "factor": seconds(factor)})
        entry |= {} if length == 1.0 else {"message_length": plain(length)}
        entry["at"] = _at([each.path for each in here])
        made.append((sequence, name if number == 0 else names.fresh(name), entry))
    return made


def _scheduler(part: Part, places: list[Place], notes: Notes) -> Made:
    policy = _POLICIES[part.entity.kind]
    entry = Flow({"type": "Processor", **({} if policy == "fcfs" else {"policy": policy})})
    if _settings(part, notes, "preemptive").get("preemptive") is False or policy == "fcfs":
        entry["preemptive"] = False
    entry["times"] = Flow({each.path: seconds(each.value("executionTime", 0.0)) for each in places})
    if policy == "priority":
        given = {each.path: plain(value) for each in places if (value := each.value("priority")) is not None}
        entry |= {"priorities": Flow(given)} if given else {}
    if policy == "edf":
        entry["deadlines"] = Flow({each.path: seconds(each.value("deadline", 0.0)) for each in places})
    entry["at"] = _at([each.path for each in places])
    return [(_sequence(places), part.around.names.of(part.entity.name), entry)]


def _model(part: Part, places: list[Place], written: _Entry) -> Made:
    part.name = part.around.names.of(part.entity.name)
    entry = written(part)
    at: list[Any] = []
    requests = [name for name, each in part.parts.items() if each.role == "request"]
    for place in places:
        asked = next((text for each in ("inputPort", "requestPort", "port") if (text := place.said.word(each))), "")
        pointcut: dict[str, object] = {"at": place.path}
        if len(requests) > 1:
            if asked not in part.parts:
                raise ExpressionError(f"{place.path} names {asked!r}, which is not a request port")
            pointcut["request"] = part.ports.of(asked)
        if not place.is_port:
            pointcut["time"] = seconds(place.value("executionTime", 0.0))
        at.append(place.path if len(pointcut) == 1 else Flow(pointcut))
    entry["at"] = _at(at)
    return [(_sequence(places), part.name, entry)]
