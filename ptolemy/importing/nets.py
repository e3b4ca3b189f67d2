"""Finds the widths of relations, and the nets of one channel each: which ports of a composite are joined."""

from __future__ import annotations

from collections.abc import Iterator

from .budget import spend
from .entities import Link
from .notes import Notes
from .parts import End, Net, Part
from .syntax import ExpressionError
from .table import Face
from .tables import table

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
        self._of: dict[str, str] = {name: name for name in part.entity.relations}
        self.joined: dict[str, list[tuple[int, str]]] = {}
        for one, other, order in part.entity.joined:
            if one in self._of and other in self._of:
                self._of[self._root(one)] = self._root(other)
                self.joined.setdefault(one, []).append((order, other))
                self.joined.setdefault(other, []).append((order, one))
        self.members: dict[str, list[str]] = {}
        for name in self._of:
            self.members.setdefault(self._root(name), []).append(name)
        self.width: dict[str, int | None] = dict.fromkeys(self.members)
        for name, relation in part.entity.relations.items():
            said = relation.word("width", "Auto")
            try:
                found = part.scope.value(said) if said != "Auto" else None
            except ExpressionError as error:
                notes.note(f"the width {said!r} of {name}: {error}")
                continue
            if isinstance(found, int) and found >= 0:
                self.width[self._root(name)] = min(found, MAX_WIDTH)

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
    unknown = [(here, group) for here in groups.values() for group in here.width]  # outer ones first
    for first in [None, *unknown]:
        if first is not None and first[0].width[first[1]] is not None:
            continue
        if first is not None:
            first[0].width[first[1]] = 1
        while _propagate(groups):
            pass


def _propagate(groups: dict[int, _Groups]) -> bool:
    """Carry known widths on; whether any was found."""
    found = False
    for each in _sides(groups):
        found = _balance(*each) or found
    return found


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
            others = [(order, other, -1) for order, other in groups.joined.get(name, [])]
            stack += sorted([*at.get(name, []), *others], reverse=True)
