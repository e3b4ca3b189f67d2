"""Writes nets as connections: a line each, in an order that keeps the channels of all multiports."""

from __future__ import annotations

import heapq
from itertools import pairwise
from typing import Any

from epicycle.actors import declared_ports

from ..dialect import known_types
from .entities import Entity
from .modes import is_machine
from .parts import Converting, CountsEnds, Level
from .relations import End, Net
from .writing import Flow


def connections_of(conversion: Converting, level: Level) -> list[Any]:
    """The connections of a composite."""
    counting = conversion.counting
    made = [_Line(conversion, level, net, counting) for net in conversion.nets_of(level.entity)]
    lines = [each for each in made if each.sources and each.sinks]
    for each in made:
        if each.sinks and not each.sources and any("." in sink for sink in each.sinks):
            level_path = level.told(each.sinks[0])
            conversion.notes.note(f"{level_path} has no sender connected to it")
    written = [line for each in _ordered(lines, conversion, level) for line in each.written()]
    for (composite, path), port in conversion.triggers.items():
        actor, _, name = path.rpartition(".")
        if composite == id(level.entity) and (part := level.parts.get(actor)) is not None:
            ours = conversion.port_of(level.entity.entities[actor], part, name, 0)
            written.append(f"{level.ports.of(port)} -> {part.name}.{ours}")
    return written


class _Line:
    """One connection, with what must be known about its ends."""

    def __init__(self, conversion: Converting, level: Level, net: Net, counting: CountsEnds) -> None:
        self.ends: list[End] = net.ends
        self.sources: list[str] = []
        self.sinks: list[str] = []
        self.again: list[str] = []  # ports that it reaches through more than one channel
        for end in net.ends:
            found = conversion.end(level, end)
            if found is None:
                continue
            if found[0] not in (self.sources if found[1] else self.sinks):
                (self.sources if found[1] else self.sinks).append(found[0])
            elif not found[1]:
                self.again.append(found[0])
        self.shared = self._is_shared(conversion, level, counting)

    def _is_shared(self, conversion: Converting, level: Level, counts: CountsEnds) -> bool:
        """Whether the connection must be marked as one shared channel."""
        if counts.senders(level.entity, self.ends) > 1:
            return True
        if counts.receivers(level.entity, self.ends) < 2:
            return False
        return any(_sends_by_channel(conversion, level, end) for end in self.ends)

    def written(self) -> list[Any]:
        """The line, and further lines if it reaches a port through several channels."""
        return [self._written(self.sinks), *(self._written([each]) for each in self.again)]

    def _written(self, sinks: list[str]) -> Any:
        if not self.shared:
            return f"{', '.join(self.sources)} -> {', '.join(sinks)}"
        one = [each[0] if len(each) == 1 else each for each in (self.sources, sinks)]
        return Flow({"from": one[0], "to": one[1], "shared": True})


def _sends_by_channel(conversion: Converting, level: Level, end: End) -> bool:
    """Whether this is an output with channels of one of our actors."""
    part = level.parts.get(end.actor)
    if part is None or part.row is None or end.port not in part.row.ports:
        return False
    said = part.row.ports[end.port]
    kind = known_types().actors.get(part.row.type)
    if said.face.direction == "input" or kind is None:
        return False
    port = declared_ports(kind).get(said.ours)
    return port is None or port.multi


class Counting:
    """Counts the actor outputs that lead into a net and the inputs that it reaches, across borders of composites."""

    def __init__(self, conversion: Converting) -> None:
        self._conversion = conversion
        self._found: dict[tuple[int, str, int, bool], int] = {}  # 0 while it is being counted
        self._nets: dict[tuple[int, bool], int] = {}
        self._ends: dict[tuple[int, bool], tuple[list[End], int]] = {}  # by the identity of the ends, kept alive here
        self._machines: dict[int, bool] = {}

    def senders(self, composite: Any, ends: list[End]) -> int:
        """How many outputs of actors lead to these ends of a net; 2 means several."""
        return self._all(composite, ends, senders=True)

    def receivers(self, composite: Any, ends: list[End]) -> int:
        """How many inputs of actors these ends lead to; 2 means several."""
        return self._all(composite, ends, senders=False)

    def _all(self, composite: Any, ends: list[End], *, senders: bool) -> int:
        key = (id(ends), senders)
        if key not in self._ends:
            found = 0
            for end in ends:
                found += self._beyond(composite, end, senders=senders)
                if found > 1:
                    break
            self._ends[key] = ends, min(found, 2)
        return self._ends[key][1]

    def _beyond(self, composite: Any, end: End, *, senders: bool) -> int:
        """How many there are beyond one end; 2 means several."""
        conversion = self._conversion
        child = composite.entities.get(end.actor) if end.actor else composite
        face = None if child is None else conversion.face(child, end.port)
        if face is None:
            return 0
        comes_from = (face.direction == "output") == bool(end.actor)
        if comes_from is not senders:
            return 0
        if end.actor and (id(child) not in conversion.wiring.groups or self._is_machine(child)):
            return 1
        # Continue on the other side of a composite's port.
        if end.actor:
            inside, actor = child, ""
        else:
            inside, actor = conversion.container_of(composite), composite.name
        if inside is None:
            return 0
        if self._is_machine(inside):  # its refinements are joined to its ports by name
            return 1
        key = (id(inside), f"{actor}.{end.port}", end.channel, senders)
        if key not in self._found:
            self._found[key] = 0
            for net in conversion.nets_at(inside, actor, end.port, end.channel):
                self._found[key] = min(self._found[key] + self._in_net(inside, net, senders=senders), 2)
        return self._found[key]

    def _is_machine(self, entity: Entity) -> bool:
        if id(entity) not in self._machines:
            self._machines[id(entity)] = is_machine(entity)
        return self._machines[id(entity)]

    def _in_net(self, composite: Any, net: Net, *, senders: bool) -> int:
        """The same for all of a net: the end from which it was reached never counts itself."""
        key = (id(net), senders)
        if key not in self._nets:
            self._nets[key] = 0
            self._nets[key] = self._all(composite, net.ends, senders=senders)
        return self._nets[key]


def _ordered(lines: list[_Line], conversion: Converting, level: Level) -> list[_Line]:
    """The lines in their order, changed where the channels of a multiport require it."""
    channels: dict[str, list[tuple[int, int, int]]] = {}
    for number, line in enumerate(lines):
        for end in line.ends:
            found = conversion.end(level, end)
            if found is not None:
                rank = _rank(level, end)
                channels.setdefault(found[0], []).append((rank, end.channel, number))
    after: dict[int, set[int]] = {number: set() for number in range(len(lines))}
    before = dict.fromkeys(after, 0)
    for taken in channels.values():
        order = [number for _, _, number in sorted(taken)]
        for one, other in pairwise(order):
            if one != other and other not in after[one]:
                after[one].add(other)
                before[other] += 1
    ready = [number for number, count in before.items() if not count]
    found_order: list[_Line] = []
    left = set(before)
    while left:
        if not ready:
            ready = [min(left)]
            conversion.notes.note(f"{level.path or 'the model'}: some channels of multiports are in a different order")
        number = heapq.heappop(ready)
        if number not in left:
            continue
        left.discard(number)
        found_order.append(lines[number])
        for other in after[number]:
            before[other] -= 1
            if before[other] == 0:
                heapq.heappush(ready, other)
    return found_order


def _rank(level: Level, end: End) -> int:
    """The position of a port among those of an actor that become one port of ours."""
    part = level.parts.get(end.actor)
    if part is None or part.row is None:
        return 0
    return list(part.row.ports).index(end.port) if end.port in part.row.ports else 0
