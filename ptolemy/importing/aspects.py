"""Converts aspects: the settings that Ptolemy's decorators keep at the ports and actors where they are enabled."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from .actors import is_decoration, is_layout, plain, seconds
from .entities import Entity, Property, kind
from .parts import Converting, Level
from .reasons import why_not
from .scope import Scope
from .syntax import ExpressionError
from .writing import Flow

BUSES = frozenset({"Bus", "AtomicCommunicationAspect"})
SCHEDULERS = {"FCFSScheduler": "fcfs", "FixedPriorityScheduler": "priority", "EDFScheduler": "edf"}
MODELS = frozenset({"CompositeCommunicationAspect", "CompositeExecutionAspect", "CompositeQuantityManager"})
REQUESTS = frozenset({"CommunicationRequestPort", "ExecutionRequestPort", "CQMInputPort"})
RESPONSES = frozenset({"CommunicationResponsePort", "ExecutionResponsePort", "CQMOutputPort"})
LOWEST = 2**31 - 1
_STAGES = {"inputBufferDelay": "in", "switchFabricDelay": "fabric", "outputBufferDelay": "out"}  # of a switch


def is_aspect(entity: Entity) -> bool:
    """Whether it is an aspect rather than an actor."""
    package = ".aspect." in entity.java or ".resourceScheduler" in entity.java or ".aspects." in entity.java
    return (
        kind(entity) in MODELS or kind(entity) in SCHEDULERS or (package and kind(entity) not in REQUESTS | RESPONSES)
    )


def is_request(entity: Property) -> bool:
    """Whether tokens or firings enter an aspect's model here."""
    return kind(entity) in REQUESTS


def is_response(entity: Property) -> bool:
    """Whether tokens or firings leave an aspect's model here."""
    return kind(entity) in RESPONSES


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


def is_decorated(entity: Entity) -> bool:
    """Whether any aspect is enabled at an actor or its ports."""
    return any(_is_enabled(said) for owner in (entity, *entity.ports.values()) for said in owner.properties.values())


def _is_enabled(said: Property) -> bool:
    return is_decoration(said) and (said.text("enable") or "").strip() not in ("", "false")


def aspects_of(conversion: Converting, level: Level) -> dict[str, Flow]:
    """The aspects that a composite declares, in the order in which a token meets them."""
    found: dict[str, Flow] = {}
    aspects = [each for each in level.entity.entities.values() if is_aspect(each)]
    if not aspects:
        return found
    places: dict[str, list[Place]] = {}
    for place in _places(conversion, level, level.entity, ""):
        name = (place.said.text("decoratorName") or "").rpartition(".")[2]
        places.setdefault(name, []).append(place)
    made: Made = []
    for aspect in aspects:
        here = places.pop(aspect.name, [])
        try:
            make = _MAKERS.get(kind(aspect))
            if make is None and not here:
                told = f"{level.told(aspect.name)}, a {aspect.java},"
                conversion.notes.note(f"{told} is not enabled anywhere and is left out")
            elif make is None:
                conversion.notes.error(
                    f"{level.told(aspect.name)} is a {aspect.java}, which has no counterpart{why_not(aspect.java)}"
                )
            else:
                made += make(conversion, level, aspect, here)
        except (ExpressionError, ValueError, TypeError) as error:
            conversion.notes.error(f"{level.told(aspect.name)}: {error}")
    # Aspects at ports follow their sequence numbers; they share the positions that they have among the others.
    at_ports = iter(sorted((each for each in made if each[0] is not None), key=lambda each: each[0] or 0.0))
    for sequence, name, entry in made:
        if sequence is not None:
            _, name, entry = next(at_ports)
        found[name] = entry
    return found


def _places(conversion: Converting, level: Level, entity: Entity, prefix: str) -> Iterator[Place]:
    """The ports and actors inside at which aspects are enabled."""
    inner = conversion.levels.get(id(entity))
    for child in entity.entities.values():
        if inner is None or child.name not in inner.parts:
            continue
        part = inner.parts[child.name]
        if part is None:
            continue
        path, scope = f"{prefix}{part.name}", conversion.scope_of(child)
        for said in child.properties.values():
            if _is_enabled(said):
                yield Place(path, said, scope, False)
        for port in child.ports.values():
            for said in port.properties.values():
                if _is_enabled(said):
                    ours = conversion.port_of(child, part, port.name, 0)
                    yield Place(f"{path}.{ours}", said, scope, True)
        yield from _places(conversion, level, child, f"{path}.")


Made = list[tuple[float | None, str, Flow]]  # the sequence number if it is at ports, the name, the entry


def _sequence(places: list[Place]) -> float | None:
    return min((float(each.value("sequenceNumber", 0)) for each in places if each.is_port), default=None)


def _at(places: list[Any]) -> Any:
    return places[0] if len(places) == 1 else places


def _bus(conversion: Converting, level: Level, aspect: Entity, places: list[Place]) -> Made:
    scope = conversion.scope_of(aspect)
    name = level.names.of(aspect.name)
    factor = 0.1
    for key, said in aspect.properties.items():
        if key in ("serviceTimeMultiplicationFactor", "serviceTime"):
            factor = factor if (value := scope.value_of(said)) is None else value
        elif not is_layout(said) and not is_decoration(said) and said.value is not None:
            conversion.notes.note(f"{level.told(aspect.name)}.{key} = {said.value!r} has no counterpart")
    # One declaration for each message length and sequence number; all of them share one medium.
    groups: dict[tuple[float, float], list[Place]] = {}
    for place in places:
        key_of = (float(place.value("sequenceNumber", 0)), float(place.value("messageLength", 1)))
        groups.setdefault(key_of, []).append(place)
    if not groups:
        conversion.notes.note(f"{level.told(aspect.name)} is not enabled anywhere and is left out")
    made: Made = []
    for number, ((sequence, length), here) in enumerate(groups.items()):
        entry = Flow({"type": "Bus", "factor": seconds(factor)})
        if len(groups) > 1:
            entry = Flow({"type": "Bus", "medium": name, "factor": seconds(factor)})
        if length != 1.0:
            entry["message_length"] = plain(length)
        entry["at"] = _at([each.path for each in here])
        made.append((sequence, name if number == 0 else level.names.fresh(name), entry))
    return made


def _switch(conversion: Converting, level: Level, aspect: Entity, places: list[Place]) -> Made:
    """A switch: a buffer for each input port, its fabric, and a buffer for each output port."""
    scope, told = conversion.scope_of(aspect), level.told(aspect.name)
    delays = dict.fromkeys(_STAGES, 0.1)
    for key, said in aspect.properties.items():
        if key in delays:
            delays[key] = delays[key] if (value := scope.value_of(said)) is None else value
        elif key != "numberOfPorts" and not is_layout(said) and not is_decoration(said) and said.value is not None:
            conversion.notes.note(f"{told}.{key} = {said.value!r} has no counterpart")
    if not places:
        conversion.notes.note(f"{told} is not enabled anywhere and is left out")
    # In a crossbar, tokens from different input ports pass the fabric and leave it independently.
    ports = ("portIn", "portIn", "portIn") if kind(aspect) == "CrossbarSwitch" else ("portIn", "", "portOut")
    made: Made = []
    for (name, delay), port in zip(delays.items(), ports, strict=True):
        groups: dict[object, list[Place]] = {}
        for place in places:
            groups.setdefault(place.value(port, int(port == "portOut")) if port else 0, []).append(place)
        for here in groups.values():
            entry = Flow({"type": "Bus", "factor": seconds(delay), "at": _at([each.path for each in here])})
            made.append((_sequence(here), level.names.fresh(f"{aspect.name}_{_STAGES[name]}"), entry))
    return made


def _scheduler(conversion: Converting, level: Level, aspect: Entity, places: list[Place]) -> Made:
    scope, told = conversion.scope_of(aspect), level.told(aspect.name)
    if not places:
        conversion.notes.note(f"{told} is not enabled anywhere and is left out")
        return []
    entry = Flow({"type": "Processor"})
    policy = SCHEDULERS[kind(aspect)]
    if policy != "fcfs":
        entry["policy"] = policy
    for key, said in aspect.properties.items():
        if key == "preemptive":
            if scope.value_of(said) is False:
                entry["preemptive"] = False
        elif key not in ("justMonitor",) and not is_layout(said) and not is_decoration(said) and said.value is not None:
            conversion.notes.note(f"{told}.{key} = {said.value!r} has no counterpart")
    if policy == "fcfs":
        entry["preemptive"] = False
    entry["times"] = {each.path: seconds(each.value("executionTime", 0.0)) for each in places}
    if policy == "priority":
        priorities = {each.path: each.value("priority", LOWEST) for each in places}
        if any(value != LOWEST for value in priorities.values()):
            entry["priorities"] = {path: plain(value) for path, value in priorities.items() if value != LOWEST}
    if policy == "edf":
        entry["deadlines"] = {each.path: seconds(each.value("deadline", 0.0)) for each in places}
    entry["at"] = _at([each.path for each in places])
    return [(_sequence(places), level.names.of(aspect.name), entry)]


def _model(conversion: Converting, level: Level, aspect: Entity, places: list[Place]) -> Made:
    told = level.told(aspect.name)
    if not places:
        conversion.notes.note(f"{told} is not enabled anywhere and is left out")
        return []
    name = level.names.of(aspect.name)
    part = conversion.composite_part(aspect, level, name)
    inner = conversion.levels[id(aspect)]
    entry = Flow(part.entry)
    at: list[Any] = []
    requests = [each.name for each in aspect.entities.values() if kind(each) in REQUESTS]
    for place in places:
        asked = next(
            (text.strip() for each in ("inputPort", "requestPort", "port") if (text := place.said.text(each))), ""
        )
        pointcut: dict[str, object] = {"at": place.path}
        if len(requests) > 1:
            if asked not in aspect.entities:
                raise ExpressionError(f"{place.path} names {asked!r}, which is not a request port")
            pointcut["request"] = inner.ports.of(asked)
        if not place.is_port:
            pointcut["time"] = seconds(place.value("executionTime", 0.0))
        at.append(place.path if len(pointcut) == 1 else pointcut)
    entry["at"] = _at(at)
    return [(_sequence(places), name, entry)]


_MAKERS: dict[str, Callable[[Converting, Level, Entity, list[Place]], Made]] = {
    "Bus": _bus,
    **dict.fromkeys(("BasicSwitch", "CrossbarSwitch"), _switch),
    **dict.fromkeys(SCHEDULERS, _scheduler),
    **dict.fromkeys(MODELS, _model),
}
