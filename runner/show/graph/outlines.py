"""What a drawing of a model contains: a tree of boxes with ports, and the links between them.

A replicated array with identical instances becomes one box; a composite below the requested depth becomes a closed box.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import accumulate, chain

from epicycle.actors import InputPort, OutputPort, PortParameter, counted
from epicycle.aspects import Medium, Processor

from ...model.build.model import Model
from ...model.graph.clock import Clock
from ...model.graph.nodes import Edge
from ...model.graph.woven import WovenAspect

MANY = 60  # boxes that a reader can take in; a larger model is folded by default
START, MODE, FINAL = "start", "mode", "final mode"  # shapes of boxes in a statechart


@dataclass(eq=False)
class Port:
    """A port of a box, with the names of the aspects attached to it, in the order in which a token meets them."""

    path: str
    name: str
    is_multi: bool
    aspects: tuple[str, ...]


@dataclass(frozen=True)
class Link:
    """A connection; ``delay`` is in ns.

    If it represents several, ``words`` state how many, unless it is one for each instance of the boxes at its ends; of
    a transition, they are its label.
    """

    source: str
    target: str
    delay: int | None
    words: str = ""


@dataclass(eq=False)
class Box:
    """An actor or a composite; the model itself is the outermost box, with an empty path.

    ``kind`` is its type and, if it has a local clock, the settings of that; ``has_director``: it fires as one actor.
    A mode has a ``shape`` instead, and its ``kind`` are lines of what it does.
    ``count`` is the number of instances of an array that it represents, or of ``members`` that are no array.
    ``is_closed``: a composite whose inside is not shown.  ``aspects`` are attached to the actor itself, or inside the
    closed composite.
    """

    path: str
    name: str
    kind: str
    inputs: list[Port] = field(default_factory=list)
    outputs: list[Port] = field(default_factory=list)
    children: list[Box] = field(default_factory=list)
    links: list[Link] = field(default_factory=list)
    count: int = 1
    members: tuple[str, ...] = ()
    is_composite: bool = False
    has_director: bool = False
    is_closed: bool = False
    aspects: tuple[str, ...] = ()
    shape: str = ""

    @property
    def is_open(self) -> bool:
        """Whether its inside is shown."""
        return self.is_composite and not self.is_closed

    def walk(self) -> Iterator[Box]:
        """All boxes below this one, outer ones first."""
        for child in self.children:
            yield child
            yield from child.walk()


@dataclass
class Outline:
    """The content of a drawing: the outermost box, the depth to which it is opened, and the depth of the model."""

    model: Model
    root: Box
    depth: int
    levels: int

    @property
    def size(self) -> int:
        """The number of boxes, the outermost included."""
        return sum(1 for _ in self.root.walk())

    @property
    def note(self) -> str:
        """A note for the reader if not everything is shown; otherwise empty."""
        closed = sum(1 for box in self.root.walk() if box.is_closed)
        if not closed:
            return ""
        are = "is" if closed == 1 else "are"
        return f"{counted(closed, 'composite')} {are} drawn closed; --depth {self.levels} opens everything"


def outline(
    model: Model,
    depth: int | None = None,
    expand: bool = False,
    *,
    most: int = MANY,
    few: int = 1,
    limit: int = sys.maxsize,
) -> Outline:
    """The boxes and links of a model.

    Composites down to ``depth`` levels are opened, by default as long as there are at most ``most`` boxes.  Without
    ``expand``, arrays with more than a ``few`` instances are one box if these are identical.  If there are more than
    ``limit`` boxes nevertheless, what is of one type is one box.
    """
    outliner = _Outliner(model, sys.maxsize if expand else few)
    root = outliner.box("")
    rows = [[root]]  # the boxes at each depth
    while rows[-1]:
        rows.append([child for box in rows[-1] for child in box.children])
    levels = max(level for level, row in enumerate(rows) if any(box.is_composite for box in row))
    if depth is None:
        sizes = accumulate(map(len, rows[1:]))
        depth = max((deep for deep, size in enumerate(sizes) if deep <= levels and size <= most), default=0)
    lowest = [box for row in rows[depth + 1 : depth + 2] for box in row]
    if sum(map(len, rows[1 : depth + 2])) > limit:
        outliner.fold(limit)
        root, depth = outliner.box(""), 0
        lowest = root.children
    for box in lowest:
        if box.is_composite:
            box.is_closed, box.children, box.links = True, [], []
            box.aspects = outliner.aspects_within(box.path)
    return Outline(model, root, depth, levels)


class _Outliner:
    """Makes boxes and links from a model graph."""

    def __init__(self, model: Model, few: int) -> None:
        self.model = model
        self.graph = model.graph
        self.standing: dict[str, list[str]] = {}
        for woven in model.aspects:
            for path in dict.fromkeys((*woven.ports, *woven.actors, *map(_owner, woven.parameters))):
                self.standing.setdefault(path, []).append(woven.name)
        self.edges: dict[str, list[Edge]] = {}  # by the composite that contains them
        self.outside: dict[str, list[Edge]] = {}  # by the box where they end
        for edge in chain.from_iterable(map(self.graph.outgoing, self.graph.ports)):
            owner = _owner(edge.source)
            scope = owner if self.graph.direction(edge.source) == "input" else _owner(owner)
            self.edges.setdefault(scope, []).append(edge)
            for end in {_owner(edge.source), _owner(edge.destination)} - {scope}:
                self.outside.setdefault(end, []).append(edge)
        # The arrays whose instances look identical in the drawing.  At first, all are assumed identical.  An array that
        # is not is drawn instance by instance, which may reveal differences between the instances of another array; so
        # the search continues until nothing changes.
        composites = ("", *self.graph.composites)
        arrays = [array for each in composites for array in self.graph.parts(each).values() if len(array) > few]
        self.places: dict[str, int] = {}  # of instances in their array
        before = -1
        while len(arrays) != before:
            before = len(arrays)
            self.alike = {path: array for array in arrays for path in array}
            arrays = [array for array in arrays if len(set(map(self._look, array))) == 1]

    def fold(self, most: int) -> None:
        """Make one box of the outermost parts of a type whose names differ in digits only, or of all of a type."""
        for digits in (r"\d+", ".*"):
            groups: dict[object, list[str]] = {}
            for path in self._children(""):
                ports = tuple(port.rpartition(".")[2] for port in chain(*self._ports(path)))
                groups.setdefault((re.sub(digits, "#", path), self._kind(path), ports), []).append(path)
            if len(groups) <= most:
                break
        self.alike = {path: group for group in groups.values() for path in group}
        for path, (first, *_) in self.alike.items():
            for place in (path, *chain(*self._ports(path))):  # the box has the aspects of all
                for name in self.standing.get(place, ()):
                    if name not in (shown := self.standing.setdefault(first + place[len(path) :], [])):
                        shown.append(name)

    def _look(self, instance: str) -> frozenset[object]:
        """What a drawing shows of an instance, without its index: its inside, aspects, and connections."""
        index = instance.rpartition("[")[2]

        def inside(path: str) -> str:
            """A path inside the instance, without the indices of arrays that are one box."""
            parts, whole = [], instance
            for part in path[len(instance) :].split("."):
                whole = f"{whole}.{part}" if part else whole
                parts.append(part.partition("[")[0] + "[*]" if whole in self.alike else part)
            return ".".join(parts)

        def beside(path: str) -> str:
            """A port next to the instance: in arrays that are one box, only "the same index" or another one matters."""
            owner, _, port = path.rpartition(".")
            if owner not in self.alike or owner == _owner(instance):
                return path
            array, _, other = owner.rpartition("[")
            return f"{array}[{'=' if other == index else '#'}].{port}"

        seen: set[object] = set()
        waiting = [instance]
        while waiting:
            path = waiting.pop()
            children = self._children(path)
            seen.add((inside(path), self._kind(path), len(children)))
            for place in (path, *chain(*self._ports(path))):
                names = [inside(n) if n.startswith(f"{instance}.") else n for n in self.standing.get(place, ())]
                seen.add((inside(place), *names))
            seen.update(
                (inside(edge.source), inside(edge.destination), edge.delay) for edge in self.edges.get(path, ())
            )
            waiting += children
        for edge in self.outside.get(instance, ()):
            ends = [inside(end) if _owner(end) == instance else beside(end) for end in (edge.source, edge.destination)]
            seen.add((*ends, edge.delay, "outside"))
        return frozenset(seen)

    def _children(self, path: str) -> list[str]:
        return list(chain.from_iterable(self.graph.parts(path).values()))

    def _ports(self, path: str) -> tuple[list[str], list[str]]:
        """The inputs and outputs of an actor or composite."""
        actor = self.graph.actors.get(path)
        if actor is None:
            return self.graph.borders(path)
        return [port.path for port in actor.inputs.values()], [port.path for port in actor.outputs.values()]

    def _kind(self, path: str) -> str:
        return self.graph.components[path].kind

    def box(self, path: str) -> Box:
        name, count = path.rpartition(".")[2], len(self._instances(path))
        box = Box(path, name, self._kind(path), count=count, is_composite=path not in self.graph.actors)
        if count > 1 and len({each.partition("[")[0] for each in self._instances(path)}) == 1:
            box.name = f"{name.partition('[')[0]}[0..{count - 1}]"
        elif count > 1:
            box.name, box.members = f"{name} and {count - 1:,} more", tuple(self._instances(path))
        if path in self.graph.domains:
            box.has_director = bool(path)
            box.kind += _clock(self.graph.domains[path].clock)
        for side, paths in zip((box.inputs, box.outputs), self._ports(path), strict=True):
            for port_path in paths:
                port = self.graph.ports[port_path].port
                # The port of a parameter is only shown if it is used.
                is_parameter = port is not None and isinstance(
                    getattr(type(port.actor), port.name, None), PortParameter
                )
                if not is_parameter or self.graph.incoming(port_path) or port_path in self.standing:
                    is_multi = isinstance(port, InputPort | OutputPort) and port.multi
                    side.append(Port(port_path, port_path.rpartition(".")[2], is_multi, self._aspects_at(port_path)))
        if box.is_composite:
            children = (child for child in self._children(path) if child == self._instances(child)[0])
            box.children = [self.box(child) for child in children]
            shown = {port.path for each in (box, *box.children) for port in (*each.inputs, *each.outputs)}
            # A part with a mistake has no ports, and no box.
            box.links = [link for link in self._links(path) if {link.source, link.target} <= shown]
        else:
            box.aspects = self._aspects_at(path)
        return box

    def _aspects_at(self, path: str) -> tuple[str, ...]:
        return tuple(map(short_name, self.standing.get(path, ())))

    def aspects_within(self, composite: str) -> tuple[str, ...]:
        names = (
            short_name(woven.name)
            for woven in self.model.aspects
            for path in (*map(_owner, (*woven.ports, *woven.parameters)), *woven.actors)
            if path.startswith(f"{composite}.")
        )
        return tuple(dict.fromkeys(names))

    def _links(self, path: str) -> list[Link]:
        """The connections inside a composite; those between instances in one box are one link."""
        links: dict[tuple[str, str, int | None], list[Edge]] = {}
        for edge in self.edges.get(path, ()):
            links.setdefault((self._shown(edge.source), self._shown(edge.destination), edge.delay), []).append(edge)
        return [Link(*key, self._how_many(path, *key[:2], edges)) for key, edges in links.items()]

    def _how_many(self, path: str, source: str, target: str, edges: list[Edge]) -> str:
        """The label for the connections that one link inside a composite represents."""
        one, other = [1 if _owner(port) == path else len(self._instances(_owner(port))) for port in (source, target)]
        count = len(edges)
        if count == max(one, other):
            if min(one, other) == 1:
                return ""
            is_same = all(self._index(edge.source) == self._index(edge.destination) for edge in edges)
            if _owner(source) == _owner(target):
                return "each to itself" if is_same else "each to another"
            return "in pairs" if is_same else f"×{count}"
        if min(one, other) > 1 and count == one * other:
            return "each to all"
        if min(one, other) > 1 and count == one * (one - 1) and _owner(source) == _owner(target):
            return "each to all others"
        return f"×{count}"

    def _index(self, port: str) -> int:
        """The index of a port's owner in its array."""
        owner = _owner(port)
        if owner not in self.places:
            self.places |= {path: number for number, path in enumerate(self._instances(owner))}
        return self.places[owner]

    def _instances(self, path: str) -> list[str]:
        """The instances that the box of an actor or composite represents."""
        return self.alike.get(path, [path])

    def _shown(self, port: str) -> str:
        """The port that represents a port in the drawing."""
        owner, _, name = port.rpartition(".")
        return f"{self._instances(owner)[0]}.{name}"


def duration(nanoseconds: int) -> str:
    """A time as a person would write it."""
    for unit, size in (("s", 1e9), ("ms", 1e6), ("µs", 1e3)):
        if nanoseconds >= size / 10:
            return f"{nanoseconds / size:g} {unit}"
    return f"{nanoseconds} ns" if nanoseconds else "0 s"


def label(link: Link) -> str:
    """The label of a connection."""
    parts = [] if link.delay is None else [duration(link.delay)]
    return ", ".join([*parts, link.words] if link.words else parts)


def short_name(aspect: str) -> str:
    """The name of an aspect without the composite in which it is declared."""
    return aspect.rpartition(".")[2]


def _clock(clock: Clock) -> str:
    """How a local clock differs from the time of the model."""
    parts = [f"from {duration(clock.start)}"] if clock.start else []
    parts += [f"×{float(clock.rate):g}"] if clock.rate != 1 else []
    return f", clock {' '.join(parts)}" if parts else ""


def _owner(path: str) -> str:
    return path.rpartition(".")[0]


def shared(woven: WovenAspect) -> tuple[str, ...] | None:
    """The medium or processor of an aspect, which other aspects may use, too; None if its places share nothing."""
    if not isinstance(woven.aspect, Medium | Processor):
        return None
    name = getattr(woven.aspect, "medium", None)
    return (woven.kind, woven.name.rpartition(".")[0], name) if name else (woven.kind, woven.name)
