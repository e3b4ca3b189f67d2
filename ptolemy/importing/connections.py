"""Writes nets as connections: a line each, in an order that keeps the channels of all multiports."""

from __future__ import annotations

import heapq
from itertools import pairwise
from typing import Any

from epicycle.actors import declared_ports

from ..dialect import known_types
from .notes import Notes
from .parts import End, Net, Part
from .reach import Reach
from .writing import Flow


def name_of(part: Part, end: End) -> str | None:
    """Our name for one end of a net inside a composite; None if it is left out."""
    if end.is_own:
        return part.port_name(end.port, end.channel)
    if end.part.is_border:
        return part.ports.of(end.part.entity.name)
    if end.part.entry is None or end.port in end.part.unwired:
        return None
    ours = end.part.port_name(end.port, end.channel)
    return None if ours in end.part.unnamed else f"{end.part.name}.{ours}"


def connections_of(part: Part, reach: Reach, notes: Notes) -> list[Any]:
    """The connections of a composite."""
    made = [_Line(part, net, reach) for net in part.nets]
    for each in made:
        if each.sinks and not each.sources and any("." in sink for sink in each.sinks):
            notes.note(f"{part.told(each.sinks[0])} has no sender connected to it")
    lines = [each for each in made if each.sources and each.sinks]
    written = [line for each in _ordered(part, lines, notes) for line in each.written()]
    for path, port in part.triggers.items():
        child = part.parts[path.rpartition(".")[0]]
        if child.entry is not None:
            written.append(f"{part.ports.of(port)} -> {child.name}.{child.port_name('trigger')}")
    return written


class _Line:
    """One connection, with what must be known about its ends."""

    def __init__(self, part: Part, net: Net, reach: Reach) -> None:
        self.ends = [
            (end, name) for end in net.ends if not end.part.is_idle and (name := name_of(part, end)) is not None
        ]
        self.sources = [*dict.fromkeys(name for end, name in self.ends if end.is_source)]
        sinks = [name for end, name in self.ends if not end.is_source]
        self.sinks = [*dict.fromkeys(sinks)]
        self._again = [name for place, name in enumerate(sinks) if name in sinks[:place]]  # through further channels
        # Whether the connection must be marked as one shared channel.
        self._is_shared = reach.count(net, senders=True) > 1 or (
            reach.count(net, senders=False) > 1 and any(_sends_by_channel(end) for end, _ in self.ends)
        )

    def written(self) -> list[Any]:
        """The line, and further lines if it reaches a port through several channels."""
        return [self._written(sinks) for sinks in (self.sinks, *([each] for each in self._again))]

    def _written(self, sinks: list[str]) -> Any:
        if not self._is_shared:
            return f"{', '.join(self.sources)} -> {', '.join(sinks)}"
        source, sink = (each[0] if len(each) == 1 else each for each in (self.sources, sinks))
        return Flow({"from": source, "to": sink, "shared": True})


def _sends_by_channel(end: End) -> bool:
    """Whether this is an output with channels of one of our actors."""
    row = end.part.row
    if row is None or end.port not in row.ports or not end.is_source:
        return False
    kind = known_types().actors.get(row.type)
    port = None if kind is None else declared_ports(kind).get(row.ports[end.port].ours)
    return kind is not None and (port is None or port.multi)


def _ordered(part: Part, lines: list[_Line], notes: Notes) -> list[_Line]:
    """The lines in their order, changed where the channels of a multiport require it."""
    channels: dict[str, list[tuple[int, int, int]]] = {}
    for number, line in enumerate(lines):
        for end, name in line.ends:
            # Among the ports of an actor that become one port of ours, they come in the order of the row.
            rank = list(end.part.row.ports).index(end.port) if end.part.row and end.port in end.part.row.ports else 0
            channels.setdefault(name, []).append((rank, end.channel, number))
    after: dict[int, set[int]] = {number: set() for number in range(len(lines))}
    before = dict.fromkeys(after, 0)
    for taken in channels.values():
        for one, other in pairwise([number for _, _, number in sorted(taken)]):
            if one != other and other not in after[one]:
                after[one].add(other)
                before[other] += 1
    ready = [number for number, count in before.items() if not count]
    found: list[_Line] = []
    while before:
        if not ready:
            ready = [min(before)]
            notes.note(f"{part.path or 'the model'}: some channels of multiports are in a different order")
        number = heapq.heappop(ready)
        if before.pop(number, None) is not None:
            found.append(lines[number])
            for other in after[number] & before.keys():
                before[other] -= 1
                if before[other] == 0:
                    heapq.heappush(ready, other)
    return found
