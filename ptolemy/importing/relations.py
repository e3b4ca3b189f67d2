"""Finds the widths of relations, and the nets of one channel each: which ports of a composite are joined."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from .budget import spend
from .entities import Entity, Link, kind

MAX_WIDTH = 1000
_IN, _OUT = "input", "output"
# Multiports with as many channels as another; and whether this also determines the other.
_AS_WIDE: dict[str, tuple[tuple[str, str, bool], ...]] = {
    **dict.fromkeys(("BooleanSelect", "ConfigurationSelect"), ((_OUT, "trueInput", True), (_OUT, "falseInput", True))),
    **dict.fromkeys(("BooleanSwitch", "ConfigurationSwitch"), (("trueOutput", _IN, True), ("falseOutput", _IN, True))),
    **dict.fromkeys(
        ("Sampler", "Sleep", "Synchronizer", "IsPresent", "TrueGate", "EventFilter", "Inhibit"), ((_OUT, _IN, True),)
    ),
    **dict.fromkeys(("MostRecent", "Register", "SamplerWithDefault"), ((_OUT, _IN, False),)),
}


@dataclass(frozen=True)
class PortFace:
    """What wiring needs to know about a port: its direction, and whether it is a multiport."""

    direction: str  # input or output
    multi: bool


Faces = Callable[[Entity, str], PortFace | None]
WidthSaid = Callable[[Entity, str], int | None]


@dataclass(frozen=True)
class End:
    """One channel of a port; ``actor`` is "" for a port of the composite itself, seen from inside."""

    actor: str
    port: str
    channel: int


@dataclass
class Net:
    """The ports joined by one channel of a relation, in the order in which they were linked."""

    ends: list[End] = field(default_factory=list)
    order: int = 0


class Groups:
    """The relations of one composite, grouped by the links between them."""

    def __init__(self, composite: Entity) -> None:
        self.composite = composite
        self._of: dict[str, str] = {name: name for name in composite.relations}
        self.joined: dict[str, list[tuple[int, str]]] = {}
        for one, other, order in composite.joined:
            if one in self._of and other in self._of:
                self._of[self._root(one)] = self._root(other)
                self.joined.setdefault(one, []).append((order, other))
                self.joined.setdefault(other, []).append((order, one))
        self._members: dict[str, list[str]] = {}
        for name in self._of:
            self._members.setdefault(self._root(name), []).append(name)
        self.width: dict[str, int | None] = dict.fromkeys(self._members)

    def _root(self, name: str) -> str:
        while self._of[name] != name:
            self._of[name] = self._of[self._of[name]]  # halves the way for the next time
            name = self._of[name]
        return name

    def of(self, link: Link) -> str | None:
        """The group that a link leads to."""
        return None if link.relation is None or link.relation not in self._of else self._root(link.relation)

    def total(self, links: list[Link]) -> int:
        """How many channels links have in all, as far as that is known."""
        found = 0
        for link in links:
            group = self.of(link)
            found += 0 if group is None else self.width[group] or 0
        return found

    def members(self, group: str) -> list[str]:
        """The relations of a group."""
        return self._members[group]


class Wiring:
    """The widths of all relations of a model, and the nets of its composites."""

    def __init__(self, model: Entity, faces: Faces, width: WidthSaid) -> None:
        self._faces = faces
        self.groups: dict[int, Groups] = {}
        self._composites = [each for each in model.everything() if each.entities or each.relations]
        for composite in self._composites:
            groups = self.groups[id(composite)] = Groups(composite)
            for name in composite.relations:
                said = width(composite, name)
                if said is not None and said >= 0:
                    groups.width[groups._root(name)] = min(said, MAX_WIDTH)
        self._infer()

    def _face(self, composite: Entity, port: str) -> PortFace | None:
        actor, _, name = port.rpartition(".")
        if not actor:
            return self._faces(composite, name)
        child = composite.entities.get(actor)
        return None if child is None else self._faces(child, name)

    def _infer(self) -> None:
        for composite in self._composites:
            groups = self.groups[id(composite)]
            for port, links in composite.links.items():
                face = self._face(composite, port)
                for link in links:
                    group = groups.of(link)
                    if group is not None and groups.width[group] is None and face is not None and not face.multi:
                        groups.width[group] = 1
        while self._propagate():
            pass
        for composite in self._composites:  # outer ones first
            widths = self.groups[id(composite)].width
            for group, width in widths.items():
                if width is None:
                    widths[group] = 1
                    while self._propagate():
                        pass

    def _propagate(self) -> bool:
        """Carry known widths from one side of a composite's ports to the other."""
        found = False
        for composite in self._composites:
            spend(len(composite.links))
            outer = self.groups[id(composite)]
            for port, links in composite.links.items():
                actor, _, name = port.rpartition(".")
                child = composite.entities.get(actor)
                for one, other, is_mutual in () if child is None else _AS_WIDE.get(kind(child), ()):
                    if name in (one, other):
                        of_one, of_other = (composite.links.get(f"{actor}.{each}", []) for each in (one, other))
                        found = self._balance(outer, of_other, outer, of_one) or found
                        found = (is_mutual and self._balance(outer, of_one, outer, of_other)) or found
                if child is None or id(child) not in self.groups or name not in child.links:
                    continue
                inner, inside = self.groups[id(child)], child.links[name]
                found = (
                    self._balance(outer, links, inner, inside) or self._balance(inner, inside, outer, links) or found
                )
        return found

    def _balance(self, known: Groups, links: list[Link], open_: Groups, others: list[Link]) -> bool:
        widths = [known.width[group] for link in links if (group := known.of(link)) is not None]
        unknown = [group for link in others if (group := open_.of(link)) is not None and open_.width[group] is None]
        if None in widths or not unknown or not links:
            return False
        difference = max(known.total(links) - open_.total(others), 0)
        if len(unknown) not in (1, difference) and difference:
            return False  # how they share the channels is unknown
        for group in unknown:
            open_.width[group] = difference // len(unknown)
        return True

    def width(self, composite: Entity, port: str) -> int:
        """How many channels a port has, seen from the composite in which it is linked."""
        groups = self.groups.get(id(composite))
        if groups is None:
            return 0
        return groups.total(composite.links.get(port, []))

    def nets(self, composite: Entity) -> list[Net]:
        """The nets of a composite, one for each channel."""
        groups = self.groups[id(composite)]
        at: dict[str, list[tuple[int, str, int]]] = {}  # for each relation: order, port, first channel
        for port, links in composite.links.items():
            face = self._face(composite, port)
            channel = 0
            for link in links:
                if (group := groups.of(link)) is not None:
                    if face is not None and link.relation is not None:
                        at.setdefault(link.relation, []).append((link.order, port, channel))
                    channel += groups.width[group] or 0
        found = []
        for group, width in groups.width.items():
            ends = self._ends(composite, groups, group, at)
            for number in range(width or 0):
                spend(1 + len(ends))
                net = Net(order=min((order for order, _, _ in ends), default=0))
                for _, port, first in ends:
                    actor, _, name = port.rpartition(".")
                    face = self._face(composite, port)
                    if number == 0 or (face is not None and face.multi):
                        net.ends.append(End(actor, name, first + number))
                found.append(net)
        return sorted(found, key=lambda net: net.order)

    def _ends(
        self, composite: Entity, groups: Groups, group: str, at: dict[str, list[tuple[int, str, int]]]
    ) -> list[tuple[int, str, int]]:
        """The ports of a group in the order in which Ptolemy visits them, starting from the relation of a sender."""
        members = groups.members(group)
        start = next(
            (name for name in members for _, port, _ in at.get(name, []) if self._sends(composite, port)), None
        )
        found: list[tuple[int, str, int]] = []
        seen: set[str] = set()
        waiting = [start] if start is not None else members[:1]
        self._visit(waiting[0], groups, at, seen, found)
        for name in members:
            self._visit(name, groups, at, seen, found)
        return found

    def _visit(
        self,
        relation: str,
        groups: Groups,
        at: dict[str, list[tuple[int, str, int]]],
        seen: set[str],
        found: list[tuple[int, str, int]],
    ) -> None:
        # A stack, because a file may link relations in a long chain.
        stack = [iter(self._linked(relation, groups, at, seen))]
        while stack:
            for order, port, channel in stack[-1]:
                if channel >= 0:
                    found.append((order, port, channel))
                elif port not in seen:
                    stack.append(iter(self._linked(port, groups, at, seen)))
                    break
            else:
                stack.pop()

    def _linked(
        self, relation: str, groups: Groups, at: dict[str, list[tuple[int, str, int]]], seen: set[str]
    ) -> list[tuple[int, str, int]]:
        """The ports and relations linked to a relation; relations have channel -1."""
        if relation in seen:
            return []
        seen.add(relation)
        others = [(order, other, -1) for order, other in groups.joined.get(relation, [])]
        return sorted([*at.get(relation, []), *others])

    def _sends(self, composite: Entity, port: str) -> bool:
        face = self._face(composite, port)
        return face is not None and (face.direction == "output") == ("." in port)
