"""Which ports of a composite each channel joins, how these nets become connections, and what they feed."""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from itertools import pairwise
from typing import Any

from epicycle.actors import InputPort, declared_ports

from ..dialect import known_types
from .document import Link
from .limits import Notes, spend
from .parts import End, Net, Part
from .syntax import ExpressionError
from .table import WORDS, Face, Row, table
from .translation import Kind
from .writing import Flow

MAX_WIDTH = 1000


def face_at(around: Part, path: str) -> Face | None:
    """The face of a port of a part inside, "actor.port", or of its own, "port"."""
    actor, _, port = path.rpartition(".")
    part = around.parts.get(actor) if actor else around
    return None if part is None else part.face(port)


class _Groups:
    """The relations of one composite, grouped by the links between them, and the width of each group."""

    def __init__(self, part: Part, notes: Notes) -> None:
        self.part = part
        self._of: dict[str, str] = {}
        self.joined: dict[str, list[tuple[int, str]]] = {name: [] for name in part.entity.relations}
        for one, other, order in part.entity.joined:
            if one in self.joined and other in self.joined:
                self.joined[one].append((order, other))
                self.joined[other].append((order, one))
        self.members: dict[str, list[str]] = {}
        for first in self.joined:
            waiting = [] if first in self._of else [first]
            while waiting:
                name = waiting.pop()
                if name not in self._of:
                    self._of[name] = first
                    self.members.setdefault(first, []).append(name)
                    waiting += [other for _, other in self.joined[name]]
        self.width: dict[str, int | None] = dict.fromkeys(self.members)
        for name, relation in part.entity.relations.items():
            said = relation.word("width", "Auto")
            try:
                found = part.scope.value(said) if said != "Auto" else None
            except ExpressionError as error:
                notes.note(f"the width {said!r} of {name}: {error}")
                continue
            if isinstance(found, int) and found >= 0:
                self.width[self._of[name]] = min(found, MAX_WIDTH)

    def of(self, link: Link) -> str | None:
        """The group that a link leads to."""
        return self._of.get(link.relation or "")

    def total(self, links: list[Link]) -> int:
        """How many channels links have in all, as far as that is known."""
        return sum(self.width[group] or 0 for link in links if (group := self.of(link)) is not None)


def wire(model: Part, notes: Notes) -> None:
    """Find the widths and nets of all composites of a model."""
    groups = {id(part): _Groups(part, notes) for part in model.everything() if part.parts or part.entity.relations}
    _infer(groups)
    for each in groups.values():
        each.part.widths = {port: each.total(links) for port, links in each.part.entity.links.items()}
        each.part.nets = _nets(each)
        for net in each.part.nets:
            for end in net.ends:
                at = end.part.inside if end.is_own else end.part.outside
                at.setdefault(end.port, []).append((end.channel, net))


# -- widths -----------------------------------------------------------------------------------------------------------

_Side = tuple[_Groups, list[Link], _Groups, list[Link]]


def _infer(groups: dict[int, _Groups]) -> None:
    for here in groups.values():
        for port, links in here.part.entity.links.items():
            face = face_at(here.part, port)
            for group in map(here.of, links):
                if group is not None and here.width[group] is None and face is not None and not face.multi:
                    here.width[group] = 1
    _spread(groups)
    for here in groups.values():  # outer ones first
        for group, width in here.width.items():
            if width is None and here.width[group] is None:
                here.width[group] = 1
                _spread(groups)


def _spread(groups: dict[int, _Groups]) -> None:
    """Carry known widths on, as far as they lead."""
    while sum(_balance(*each) for each in _sides(groups)):
        pass


def _sides(groups: dict[int, _Groups]) -> Iterator[_Side]:
    """Pairs of ports, or of sides of one, that are equally wide: the one that determines the width, and the other."""
    for outer in groups.values():
        links_of = outer.part.entity.links
        spend(len(links_of))
        for port, links in links_of.items():
            actor, _, name = port.rpartition(".")
            child = outer.part.parts.get(actor)
            if child is None:
                continue
            for text in table("words")["as wide as"].get(child.entity.kind, ()):
                one, sign, other = text.split()
                if name in (one, other):
                    of_one, of_other = (links_of.get(f"{actor}.{each}", []) for each in (one, other))
                    yield outer, of_other, outer, of_one
                    if sign == "=":
                        yield outer, of_one, outer, of_other
            if id(child) in groups and name in child.entity.links:
                yield outer, links, groups[id(child)], child.entity.links[name]
                yield groups[id(child)], child.entity.links[name], outer, links


def _balance(known: _Groups, links: list[Link], other: _Groups, others: list[Link]) -> bool:
    """Carry a known width to the other side; whether anything was found."""
    widths = [known.width[group] for link in links if (group := known.of(link)) is not None]
    unknown = [group for link in others if (group := other.of(link)) is not None and other.width[group] is None]
    if None in widths or not unknown or not links:
        return False
    difference = max(known.total(links) - other.total(others), 0)
    if len(unknown) not in (1, difference) and difference:
        return False  # how they share the channels is unknown
    for group in unknown:
        other.width[group] = difference // len(unknown)
    return True


# -- nets -------------------------------------------------------------------------------------------------------------

_Place = tuple[int, str, int]  # order, port and first channel; or order, relation and -1


def _nets(groups: _Groups) -> list[Net]:
    """The nets of a composite, one for each channel."""
    part = groups.part
    at: dict[str, list[_Place]] = {}  # what is linked to each relation
    faces = {port: face_at(part, port) for port in part.entity.links}
    for port, links in part.entity.links.items():
        channel = 0
        for link in links:
            if (group := groups.of(link)) is not None and link.relation is not None:
                if faces[port] is not None:
                    at.setdefault(link.relation, []).append((link.order, port, channel))
                channel += groups.width[group] or 0
    found = []
    for group, width in groups.width.items():
        places = list(_places(groups, groups.members[group], at, faces))
        for number in range(width or 0):
            spend(1 + len(places))
            net = Net(order=min((order for order, _, _ in places), default=0))
            for _, port, first in places:
                face, (actor, _, name) = faces[port], port.rpartition(".")
                if face is not None and (number == 0 or face.multi):
                    is_source = (face.direction == "output") == bool(actor)
                    end = part.parts[actor] if actor else part
                    net.ends.append(End(end, name, first + number, not actor, is_source))
            found.append(net)
    return sorted(found, key=lambda net: net.order)


def _places(
    groups: _Groups, members: list[str], at: dict[str, list[_Place]], faces: dict[str, Face | None]
) -> Iterator[_Place]:
    """The ports of a group in the order in which Ptolemy visits them, starting from the relation of a sender."""

    def sends(port: str) -> bool:
        face = faces[port]
        return face is not None and (face.direction == "output") == ("." in port)

    first = next((name for name in members for _, port, _ in at.get(name, []) if sends(port)), members[0])
    seen: set[str] = set()
    stack: list[_Place] = [(0, name, -1) for name in reversed([first, *members])]
    while stack:  # a stack, because a file may link relations in a long chain
        order, name, channel = stack.pop()
        if channel >= 0:
            yield order, name, channel
        elif name not in seen:
            seen.add(name)
            others = [(order, other, -1) for order, other in groups.joined[name]]
            stack += sorted([*at.get(name, []), *others], reverse=True)


# -- connections ------------------------------------------------------------------------------------------------------


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


def connections_of(part: Part, notes: Notes) -> list[Any]:
    """The connections of a composite."""
    lines = [line for net in part.nets if (line := _Line(part, net)).sources and line.sinks]
    return [line for each in _ordered(part, lines, notes) for line in each.written()]


class _Line:
    """One connection, with what must be known about its ends."""

    def __init__(self, part: Part, net: Net) -> None:
        self.ends = [
            (end, name) for end in net.ends if not end.part.is_idle and (name := name_of(part, end)) is not None
        ]
        self.sources = [*dict.fromkeys(name for end, name in self.ends if end.is_source)]
        sinks = [name for end, name in self.ends if not end.is_source]
        self.sinks = [*dict.fromkeys(sinks)]
        self._again = [name for place, name in enumerate(sinks) if name in sinks[:place]]  # through further channels
        # Whether the connection must be marked as one shared channel.
        self._is_shared = len(self.sources) > 1 or (
            len(self.sinks) > 1 and any(_sends_by_channel(end) for end, _ in self.ends)
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
    order = TopologicalSorter[int](dict.fromkeys(range(len(lines)), ()))
    for taken in channels.values():
        for one, other in pairwise([number for _, _, number in sorted(taken)]):
            if one != other:
                order.add(other, one)
    try:
        order.prepare()
    except CycleError:
        notes.note(f"{part.path or 'the model'}: some channels of multiports are in a different order")
        return lines
    ready, found = list[int](), list[_Line]()
    while order.is_active():
        for number in order.get_ready():
            heapq.heappush(ready, number)
        found.append(lines[ready[0]])
        order.done(heapq.heappop(ready))
    return found


# -- what is fed ------------------------------------------------------------------------------------------------------


class Reach:
    """Which nets anything sends into."""

    def __init__(self) -> None:
        self._fed: dict[int, bool] = {}

    def feeds(self, part: Part, port: str) -> bool:
        """Whether anything sends to a port of a part."""
        return any(self._is_fed(net) for _, net in part.outside.get(port, ()))

    def _is_fed(self, net: Net) -> bool:
        if id(net) not in self._fed:
            self._fed[id(net)] = False  # while it is being found out
            self._fed[id(net)] = any(map(self._sends, net.ends))
        return self._fed[id(net)]

    def _sends(self, end: End) -> bool:
        part = end.part
        if part.is_idle or not end.is_source:
            return False
        is_leaf = not end.is_own and (part.role == "machine" or not (part.parts or part.entity.relations))
        if is_leaf or (end.is_own and part.outer is not None and part.outer.role == "machine"):
            return True  # refinements are joined to their machine by name
        nets = (part.outside if end.is_own else part.inside).get(end.port, ())
        return any(channel == end.channel and self._is_fed(net) for channel, net in nets)


# -- actors that never fire -------------------------------------------------------------------------------------------


def leave_out_idle(model: Part, notes: Notes) -> None:
    """Leave out the actors that can never fire, and those that then never receive anything."""
    actors = [(each, row) for each in model.everything() if (row := each.row) is not None and not row.is_view]
    found = True
    while found:
        reach, found = Reach(), False
        spend(len(actors))
        lacking = [(part, _lacks(part, row, reach)) for part, row in actors if not part.is_idle]
        for part, port in lacking:
            if port is not None:
                part.is_idle = found = True
                notes.note(f"{part.path} is left out: it never fires because nothing sends to its {port}")


def _lacks(part: Part, row: Row, reach: Reach) -> str | None:
    """The input for lack of which an actor never fires; None if it may."""
    kind = known_types().actors.get(row.type)
    if kind is None:
        return None
    needs = row.settings.get("needs", "").split()
    if needs and not any(reach.feeds(part, name) for name in needs):
        return " and ".join(sorted(needs))
    names = dict.fromkeys([*row.ports, *part.entity.ports, *row.parameters, *part.entity.properties])
    inputs = [name for name in names if (face := part.face(name)) is not None and face.direction == "input"]
    if not kind.is_source and not any(reach.feeds(part, name) for name in inputs):
        return inputs[0] if inputs else "inputs"
    required = [name for name, port in declared_ports(kind).items() if isinstance(port, InputPort) and port.required]
    groups = [[name] for name in _waits_for(part, row)]
    groups += [[name for name, said in row.ports.items() if said.ours == ours] for ours in required]
    return next((names[0] for names in groups if names and not any(reach.feeds(part, each) for each in names)), None)


def _waits_for(part: Part, row: Row) -> list[str]:
    """The linked inputs added in the model to an actor that waits for a token at each of them."""
    if row.type not in ("Expression", "RecordAssembler") or row.settings.get("set", {}).get("apart"):
        return []
    added = [port for name, port in part.entity.ports.items() if name not in row.ports and port.flag("input")]
    has_value = part.entity.properties
    return [each.name for each in added if each.name in part.linked and each.name not in has_value
            and "defaultValue" not in each.properties]  # fmt: skip


# -- kinds of tokens --------------------------------------------------------------------------------------------------


def kinds_at(part: Part, row: Row) -> dict[str, Kind]:
    """The kinds of what the ports of an actor receive, judging by the parameters of the actors connected to it.

    In Ptolemy, the quotient of whole numbers has no fraction.
    """
    found: dict[str, Kind] = {}
    for port in (*row.ports, *part.entity.ports):
        ends = [end for _, net in part.outside.get(port, ()) for end in net.ends if end.is_source]
        kinds = {_sent(end.part) for end in ends if not end.part.is_idle}
        found[port] = kinds.pop() if len(kinds) == 1 else None
    return found


def _sent(part: Part) -> Kind:
    """The kind of everything that an actor sends; None if it is not known."""
    names = table("words")["what is sent"].get(part.entity.kind)
    if names is None:
        return list if part.entity.kind in WORDS["senders of arrays"] else None
    kinds: set[Kind] = set()
    for said in (part.entity.properties.get(name) for name in names):
        try:
            value = 0 if said is None else part.scope.value_of(said)
        except ExpressionError:
            return None
        kinds |= {type(each) for each in (value if names == ["values"] and isinstance(value, list) else [value])}
    return kinds.pop() if len(kinds) == 1 else None
