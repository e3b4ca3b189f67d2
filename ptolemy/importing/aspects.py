"""Converts aspects: the settings that Ptolemy's decorators keep at the ports and actors where they are enabled."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from .entities import Property, is_aside
from .leftovers import is_enabled
from .notes import Notes
from .parts import ASPECT_MODELS, Part
from .scope import Scope
from .syntax import ExpressionError
from .tables import why_not
from .writing import Flow, plain, seconds

LOWEST = 2**31 - 1
_POLICIES = {"FCFSScheduler": "fcfs", "FixedPriorityScheduler": "priority", "EDFScheduler": "edf"}


@dataclass
class Place:
    """A port or actor at which an aspect is enabled, and the aspect's settings there."""

    path: str  # as patterns name it
    said: Property
    scope: Scope
    is_port: bool

    def value(self, name: str, default: Any = None) -> Any:
        """A setting; its expression may use the other settings."""
        text = self.said.text(name)
        if text is None or not text.strip():
            return default
        return Scope(self.said, self.scope).value_of(self.said.properties[name])


Made = list[tuple[float | None, str, Flow]]  # the sequence number if it is at ports, the name, the entry
_Entry = Callable[[Part], Flow]  # writes an aspect that is a model


@dataclass
class _Aspect:
    """One aspect of a composite, and where it is enabled."""

    part: Part
    around: Part
    places: list[Place]
    notes: Notes
    entry: _Entry

    def settings(self, defaults: dict[str, Any], ignored: tuple[str, ...] = ()) -> dict[str, Any]:
        """The values of its parameters; others are reported."""
        found = dict(defaults)
        for name, said in self.part.entity.properties.items():
            if name in found:
                value = self.part.scope.value_of(said)
                found[name] = found[name] if value is None else value
            elif name not in ignored and not is_aside(said) and said.value is not None:
                self.notes.note(f"{self.part.told(name)} = {said.value!r} has no counterpart")
        return found


def aspects_of(part: Part, entry: _Entry, notes: Notes) -> dict[str, Flow]:
    """The aspects that a composite declares, in the order in which a token meets them."""
    found: dict[str, Flow] = {}
    aspects = [each for each in part.parts.values() if each.role == "aspect"]
    if not aspects:
        return found
    places: dict[str, list[Place]] = {}
    for place in _places(part, ""):
        places.setdefault((place.said.text("decoratorName") or "").rpartition(".")[2], []).append(place)
    made: Made = []
    for each in aspects:
        here = places.pop(each.entity.name, [])
        what, make = f"{each.path}, a {each.entity.java},", _MAKERS.get(each.entity.kind)
        if not here:
            notes.note(f"{each.path if make is not None else what} is not enabled anywhere and is left out")
        elif make is None:
            notes.error(f"{each.path} is a {each.entity.java}, which has no counterpart{why_not(each.entity.java)}")
        else:
            try:
                made += make(_Aspect(each, part, here, notes, entry))
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
        for said in child.entity.properties.values():
            if is_enabled(said):
                yield Place(path, said, child.scope, is_port=False)
        for port in child.entity.ports.values():
            for said in port.properties.values():
                if is_enabled(said):
                    yield Place(f"{path}.{child.port_name(port.name)}", said, child.scope, is_port=True)
        yield from _places(child, f"{path}.")


def _sequence(places: list[Place]) -> float | None:
    return min((float(each.value("sequenceNumber", 0)) for each in places if each.is_port), default=None)


def _at(places: list[Any]) -> Any:
    return places[0] if len(places) == 1 else places


def _bus(aspect: _Aspect) -> Made:
    """A declaration for each message length and sequence number; all of them share one medium."""
    name = aspect.around.names.of(aspect.part.entity.name)
    said = aspect.settings({"serviceTimeMultiplicationFactor": None, "serviceTime": None})
    factor = next((each for each in reversed(said.values()) if each is not None), 0.1)
    groups: dict[tuple[float, float], list[Place]] = {}
    for place in aspect.places:
        key = float(place.value("sequenceNumber", 0)), float(place.value("messageLength", 1))
        groups.setdefault(key, []).append(place)
    made: Made = []
    for number, ((sequence, length), here) in enumerate(groups.items()):
        entry = Flow({"type": "Bus", **({"medium": name} if len(groups) > 1 else {}), "factor": seconds(factor)})
        if length != 1.0:
            entry["message_length"] = plain(length)
        entry["at"] = _at([each.path for each in here])
        made.append((sequence, name if number == 0 else aspect.around.names.fresh(name), entry))
    return made


def _scheduler(aspect: _Aspect) -> Made:
    places, policy = aspect.places, _POLICIES[aspect.part.entity.kind]
    entry = Flow({"type": "Processor", **({} if policy == "fcfs" else {"policy": policy})})
    if aspect.settings({"preemptive": True}, ("justMonitor",))["preemptive"] is False or policy == "fcfs":
        entry["preemptive"] = False
    entry["times"] = {each.path: seconds(each.value("executionTime", 0.0)) for each in places}
    if policy == "priority":
        priorities = {each.path: each.value("priority", LOWEST) for each in places}
        if any(value != LOWEST for value in priorities.values()):
            entry["priorities"] = {path: plain(value) for path, value in priorities.items() if value != LOWEST}
    if policy == "edf":
        entry["deadlines"] = {each.path: seconds(each.value("deadline", 0.0)) for each in places}
    entry["at"] = _at([each.path for each in places])
    return [(_sequence(places), aspect.around.names.of(aspect.part.entity.name), entry)]


def _model(aspect: _Aspect) -> Made:
    part = aspect.part
    part.name = aspect.around.names.of(part.entity.name)
    entry = aspect.entry(part)
    at: list[Any] = []
    requests = [name for name, each in part.parts.items() if each.role == "request"]
    for place in aspect.places:
        asked = next((text for each in ("inputPort", "requestPort", "port") if (text := place.said.word(each))), "")
        pointcut: dict[str, object] = {"at": place.path}
        if len(requests) > 1:
            if asked not in part.parts:
                raise ExpressionError(f"{place.path} names {asked!r}, which is not a request port")
            pointcut["request"] = part.ports.of(asked)
        if not place.is_port:
            pointcut["time"] = seconds(place.value("executionTime", 0.0))
        at.append(place.path if len(pointcut) == 1 else pointcut)
    entry["at"] = _at(at)
    return [(_sequence(aspect.places), part.name, entry)]


_MAKERS: dict[str, Callable[[_Aspect], Made]] = {
    **dict.fromkeys(("Bus", "AtomicCommunicationAspect"), _bus),
    **dict.fromkeys(_POLICIES, _scheduler),
    **dict.fromkeys(ASPECT_MODELS, _model),
}
