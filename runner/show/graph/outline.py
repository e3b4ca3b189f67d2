"""What is drawn of a model: a tree of boxes with ports, and the links between them.

A replicated array whose instances are all alike becomes one box that stands for all; a composite deeper than asked for
becomes a closed box.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from epicycle.actors import InputPort, OutputPort, PortParameter, counted

from ...build import Model
from ...graph import Clock, Hop, WovenAspect

MANY = 60  # boxes that a reader can take in; a larger model is folded if nothing else is asked for

_INDEXED = re.compile(r"(.*)\[(\d+)\]\Z")


@dataclass(eq=False)
class Port:
    """A port of a box, with the names of the aspects that stand at it, in the order in which a token meets them."""

    path: str
    name: str
    is_multi: bool
    aspects: tuple[str, ...]


@dataclass(frozen=True)
class Link:
    """A connection; ``delay`` is in ns.

    If it stands for several, ``count`` says how many if that is not one for each instance of the boxes at its ends.
    """

    source: str
    target: str
    delay: int | None
    count: str = ""


@dataclass(eq=False)
class Box:
    """An actor or a composite; the model itself is the outermost box, with an empty path.

    ``kind`` is its type and, if it has a local clock, what that shows; ``has_director``: it fires as one actor.
    ``count`` is how many instances of an array it stands for.  ``is_closed``: a composite whose inside is not shown.
    ``aspects`` stand at the actor itself, or in the closed composite.
    """

    path: str
    name: str
    kind: str
    inputs: list[Port] = field(default_factory=list)
    outputs: list[Port] = field(default_factory=list)
    children: list[Box] = field(default_factory=list)
    links: list[Link] = field(default_factory=list)
    count: int = 1
    is_composite: bool = False
    has_director: bool = False
    is_closed: bool = False
    aspects: tuple[str, ...] = ()

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
    """What is drawn: the outermost box, how deep it is opened, and how deep the model goes."""

    model: Model
    root: Box
    depth: int
    levels: int

    @property
    def note(self) -> str:
        """What a reader should know if not all is shown; else empty."""
        closed = sum(1 for box in self.root.walk() if box.is_closed)
        if not closed:
            return ""
        are = "is" if closed == 1 else "are"
        return f"{counted(closed, 'composite')} {are} drawn closed; --depth {self.levels} opens everything"


def outline(model: Model, depth: int | None = None, expand: bool = False) -> Outline:
    """The boxes and links of a model.

    Composites in up to ``depth`` levels are opened; by default as many as keep the drawing readable.  Unless
    ``expand``, arrays whose instances are alike are one box.
    """
    return _Outliner(model, expand).outline(depth)


class _Outliner:
    """Reads the model graph once, and makes outlines of it."""

    def __init__(self, model: Model, expand: bool) -> None:
        self.model = model
        self.graph = model.graph
        self.standing: dict[str, list[str]] = {}
        for woven in model.aspects:
            for path in dict.fromkeys((*woven.ports, *woven.actors, *map(_owner, woven.parameters))):
                self.standing.setdefault(path, []).append(woven.name)
        self.children: dict[str, list[str]] = {"": []}
        self.ports: dict[str, list[str]] = {}
        for path in self.graph.ports.nodes:
            owner = _owner(path)
            self._add(owner)
            self.ports[owner].append(path)
        for path in (*self.graph.composites, *self.graph.actors):  # those without ports
            self._add(path)
        self.hops: dict[str, list[Hop]] = {}  # by the composite inside of which they lie
        self.outside: dict[str, list[Hop]] = {}  # by the box at which they end
        for source, _, data in self.graph.ports.edges(data=True):
            hop: Hop = data["hop"]
            owner = _owner(source)
            scope = owner if self.graph.direction(source) == "input" else _owner(owner)
            self.hops.setdefault(scope, []).append(hop)
            for end in {_owner(hop.source), _owner(hop.destination)} - {scope}:
                self.outside.setdefault(end, []).append(hop)
        self.arrays = self._arrays()
        self.alike: set[str] = set()
        if not expand:
            self._find_alike()

    def _add(self, path: str) -> None:
        """Enter a box, and those that it is in, in the order in which they are met."""
        if path and path not in self.ports:
            parent = _owner(path)
            self._add(parent)
            self.ports[path] = []
            self.children.setdefault(path, [])
            self.children[parent].append(path)

    # -- arrays ---------------------------------------------------------------------------------------------------

    def _arrays(self) -> dict[str, list[str]]:
        """The instances of each array, by its path without an index."""
        arrays: dict[str, list[str]] = {}
        for path in self.ports:
            if match := _INDEXED.match(path):
                arrays.setdefault(match[1], []).append(path)
        return {array: paths for array, paths in arrays.items() if len(paths) > 1}

    def _find_alike(self) -> None:
        """The arrays whose instances differ in nothing that would be seen.

        All are taken to be alike at first.  One that proves otherwise is drawn instance by instance, which may show
        a difference between the instances of another array; so the search goes on until nothing changes.
        """
        self.alike = set(self.arrays)
        while True:
            unlike = {array for array in self.alike if len({self._look(path) for path in self.arrays[array]}) > 1}
            if not unlike:
                return
            self.alike -= unlike

    def _folded(self, path: str) -> str | None:
        """The array, drawn as one box, of which this is an instance."""
        match = _INDEXED.match(path)
        return match[1] if match is not None and match[1] in self.alike else None

    def _look(self, instance: str) -> frozenset[object]:
        """What there is to see of an instance, its index left out: inside, aspects, and where it is connected to."""
        index = instance.rpartition("[")[2]

        def inside(path: str) -> str:
            """A path within the instance, indices of arrays that are one box left out."""
            parts, whole = [], instance
            for part in path[len(instance) :].split("."):
                whole = f"{whole}.{part}" if part else whole
                parts.append(part if self._folded(whole) is None else part.partition("[")[0] + "[*]")
            return ".".join(parts)

        def beside(path: str) -> str:
            """A port next to the instance: in arrays that are one box, only "the same index" or another counts."""
            owner, _, port = path.rpartition(".")
            array = self._folded(owner)
            if array is None or owner == _owner(instance):
                return path
            return f"{array}[{'=' if owner.rpartition('[')[2] == index else '#'}].{port}"

        seen: set[object] = set()
        waiting = [instance]
        while waiting:
            path = waiting.pop()
            seen.add((inside(path), self._kind(path), len(self.children[path])))
            for place in (path, *self.ports[path]):
                names = [inside(n) if _is_within(n, instance) else n for n in self.standing.get(place, ())]
                seen.add((inside(place), *names))
            seen.update((inside(hop.source), inside(hop.destination), hop.delay) for hop in self.hops.get(path, ()))
            waiting += self.children[path]
        for hop in self.outside.get(instance, ()):
            ends = [inside(end) if _owner(end) == instance else beside(end) for end in (hop.source, hop.destination)]
            seen.add((*ends, hop.delay, "outside"))
        return frozenset(seen)

    def _kind(self, path: str) -> str:
        actor = self.graph.actors.get(path)
        return self.graph.composites.get(path, "") if actor is None else type(actor).__name__

    # -- boxes ----------------------------------------------------------------------------------------------------

    def outline(self, depth: int | None) -> Outline:
        """The outline to a depth, or to one that a reader can take in."""
        levels = self._levels("")
        if depth is None:
            depth = next((deep for deep in range(levels, 0, -1) if self._size("", deep) <= MANY), 0)
        return Outline(self.model, self._box("", depth), depth, levels)

    def _drawn(self, path: str) -> Iterator[tuple[str, int]]:
        """The boxes directly inside a composite, and how many instances each stands for."""
        for child in self.children[path]:
            instances = self._instances(child)
            if child == instances[0]:
                yield child, len(instances)

    def _levels(self, path: str) -> int:
        """How deep composites are nested in a composite."""
        inner = [child for child, _ in self._drawn(path) if child in self.graph.composites]
        return max((1 + self._levels(child) for child in inner), default=0)

    def _size(self, path: str, depth: int) -> int:
        """How many boxes a drawing to this depth has."""
        return sum(1 + (self._size(child, depth - 1) if depth > 0 else 0) for child, _ in self._drawn(path))

    def _box(self, path: str, depth: int, count: int = 1) -> Box:
        name = path.rpartition(".")[2]
        if count > 1:
            name = f"{name.partition('[')[0]}[0..{count - 1}]"
        box = Box(path, name, self._kind(path), count=count, is_composite=path not in self.graph.actors)
        if path in self.graph.clocks:
            box.has_director = bool(path)
            box.kind += _clock(self.graph.clocks[path])
        for port_path in self.ports.get(path, ()):
            port = self.graph.ports.nodes[port_path]["port"]
            is_multi = isinstance(port, InputPort | OutputPort) and port.multi
            if not (self.graph.incoming(port_path) or port_path in self.standing) and _is_parameter(port):
                continue
            aspects = tuple(short_name(name) for name in self.standing.get(port_path, ()))
            ports = box.inputs if self.graph.direction(port_path) == "input" else box.outputs
            ports.append(Port(port_path, port_path.rpartition(".")[2], is_multi, aspects))
        if not box.is_composite:
            box.aspects = tuple(map(short_name, self.standing.get(path, ())))
        elif path and depth == 0:
            box.is_closed = True
            within = (each for each in self.model.aspects if any(_is_within(at, path) for at in _disturbed(each)))
            box.aspects = tuple(dict.fromkeys(short_name(each.name) for each in within))
        else:
            box.children = [self._box(child, depth - 1 if path else depth, n) for child, n in self._drawn(path)]
            box.links = self._links(path)
        return box

    def _links(self, path: str) -> list[Link]:
        """The connections inside a composite; those of instances that are one box are one link."""
        counts = Counter(
            (self._shown(hop.source), self._shown(hop.destination), hop.delay) for hop in self.hops.get(path, ())
        )
        return [Link(*key, self._how_many(path, *key[:2], count)) for key, count in counts.items()]

    def _how_many(self, path: str, source: str, target: str, count: int) -> str:
        """What to say of the number of connections that one link inside a composite stands for."""
        one, other = [1 if _owner(port) == path else len(self._instances(_owner(port))) for port in (source, target)]
        if count == max(one, other):
            return ""
        if min(one, other) > 1 and count == one * other:
            return "each to all"
        if min(one, other) > 1 and count == one * (one - 1) and _owner(source) == _owner(target):
            return "each to all others"
        return f"×{count}"

    def _instances(self, path: str) -> list[str]:
        """The instances for which the box of an actor or composite stands."""
        array = self._folded(path)
        return [path] if array is None else self.arrays[array]

    def _shown(self, port: str) -> str:
        """The port that is drawn for a port."""
        owner, _, name = port.rpartition(".")
        return f"{self._instances(owner)[0]}.{name}"


def duration(nanoseconds: int) -> str:
    """A time as a person would write it."""
    for unit, size in (("s", 1e9), ("ms", 1e6), ("µs", 1e3)):
        if nanoseconds >= size / 10:
            return f"{nanoseconds / size:g} {unit}"
    return f"{nanoseconds} ns" if nanoseconds else "0 s"


def label(link: Link) -> str:
    """What is written on a connection."""
    parts = [] if link.delay is None else [duration(link.delay)]
    return ", ".join([*parts, link.count] if link.count else parts)


def short_name(aspect: str) -> str:
    """The name of an aspect without the composite in which it is declared."""
    return aspect.rpartition(".")[2]


def _clock(clock: Clock) -> str:
    """How a local clock differs from the time of the model."""
    parts = [f"from {duration(clock.start)}"] if clock.start else []
    parts += [f"×{float(clock.rate):g}"] if clock.rate != 1 else []
    return f", clock {' '.join(parts)}" if parts else ""


def _is_parameter(port: Any) -> bool:
    """Whether a port is that of a parameter, and need not be seen unless something is connected to it."""
    return port is not None and isinstance(getattr(type(port.actor), port.name, None), PortParameter)


def _disturbed(woven: WovenAspect) -> list[str]:
    """The actors and composites at which, or at whose ports and parameters, an aspect stands."""
    return [*map(_owner, (*woven.ports, *woven.parameters)), *woven.actors]


def _owner(path: str) -> str:
    return path.rpartition(".")[0]


def _is_within(path: str, composite: str) -> bool:
    return path.startswith(f"{composite}.")
