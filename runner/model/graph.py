"""The model graph: every port of every actor and composite as a node, every connection as an edge.

It is a networkx multigraph that validation, scheduling, weaving and drawing read.  A *wire* is a way through it from
an actor's output port, through any composite ports, to an actor's input port.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

import networkx as nx

from epicycle.actors import Actor, InputPort, OutputPort, declared_ports, has_own_ports
from epicycle.aspects import Request

from ..text import NORMAL, Position, could_be_within
from .clock import Clock


@dataclass(frozen=True, eq=False)
class Hop:
    """One edge of the graph: a connection between two ports, as declared."""

    source: str
    destination: str
    delay: int | None  # ns; None: within the tag
    position: Position | None
    order: int

    def __str__(self) -> str:
        return f"{self.source} -> {self.destination}"


@dataclass(frozen=True)
class Wire:
    """A way from an output port to an input port."""

    source: OutputPort[Any]
    destination: InputPort[Any]
    hops: tuple[Hop, ...]

    @property
    def immediate(self) -> bool:
        """Whether a token arrives within the tag in which it is sent."""
        return all(hop.delay is None for hop in self.hops)


@dataclass(frozen=True, eq=False)
class Detour(Hop):
    """A part of the way that tokens take through an aspect that is a model, within the tag: it orders firings.

    Tokens go from where they are sent to the composite's request port, and from its response port to where they were
    going.
    """

    aspect: str


class ModelGraph:
    """The flattened graph of one model."""

    def __init__(self) -> None:
        self.ports: Any = nx.MultiDiGraph()
        self.actors: dict[str, Actor] = {}
        self.composites: dict[str, str] = {}  # the class of each composite, outer ones first
        # The composites with a director of their own, which are actors to the graph around them; "" is the model.
        self.clocks: dict[str, Clock] = {"": Clock()}
        self.members: dict[str, list[str]] = {"": []}  # what each director fires, in the order of declaration
        self.priorities: dict[str, int] = {}
        self.positions: dict[str, Position] = {}  # also of "aspect NAME", "metric NAME" and "stop_when"
        self.tags: dict[str, tuple[str, ...]] = {}  # what the model's author put on actors and composites
        self.empty_arrays: set[str] = set()  # arrays with count 0, which patterns may name all the same
        self.unknown: set[str] = set()  # actors whose type or number is not known: anything may be behind them
        self.absent: set[str] = set()  # types and tags of what would stand in empty arrays, and of unmade actors
        self.is_wired = True  # whether every connection that the model declares has been made
        self.detours: list[Detour] = []  # found when the model is checked, see ``detours``
        self.limits = NORMAL
        self._outgoing: dict[str, list[Hop]] = {}  # the edges once more: walked often, and already in order
        self._incoming: dict[str, list[Hop]] = {}
        self._borders: dict[str, tuple[list[str], list[str]]] = {}
        self._hops: dict[int, Hop] = {}  # in their order
        self._order = 0

    def add_actor(self, actor: Actor, position: Position | None) -> None:
        """Add an actor and its ports."""
        actor.home = self
        self.actors[actor.path] = actor
        self.members[self.director_of(actor.path)].append(actor.path)
        if position is not None:
            self.positions[actor.path] = position
        for port in (*actor.inputs.values(), *actor.outputs.values()):
            self.ports.add_node(port.path, port=port, direction=port.direction)

    def add_director(self, path: str, start: int | None, drift: float) -> None:
        """Give a composite a director of its own; ``start`` (ns) and ``drift`` are those of its clock."""
        outer = self.director_of(path)
        self.members[outer].append(path)
        self.members[path] = []
        self.clocks[path] = self.clocks[outer].inside(start, drift)

    def add_unmade(self, path: str, actor_type: type[Actor]) -> None:
        """Add the ports of an actor that could not be made, so that what names them is not wrong as well."""
        for name, port in declared_ports(actor_type).items():
            self.ports.add_node(f"{path}.{name}", port=None, direction=port.direction, unmade=True)
        self.absent.add(actor_type.__name__)
        if has_own_ports(actor_type):
            self.unknown.add(path)

    def add_composite_port(
        self, path: str, direction: str, position: Position | None, type: Any = None, declared: Position | None = None
    ) -> None:
        """Add a port of a composite; tokens only pass through it, which are of the ``type`` if there is one."""
        self.ports.add_node(path, port=None, direction=direction, type=type, declared=declared)
        self._borders.setdefault(self.owner(path), ([], []))[direction == "output"].append(path)
        if position is not None:
            self.positions[path] = position

    def open_requests(self, path: str) -> None:
        """Make an input of a composite the place where an aspect's requests come in: tokens begin their way there."""
        port = OutputPort(Request, multi=True)
        port.name, port.path = path.rpartition(".")[2], path
        self.ports.nodes[path]["port"] = port

    def leave_open(self, composite: str) -> None:
        """Nothing more is said of what comes into a composite: another problem has been told."""
        for port in self.borders(composite)[0]:
            self.ports.nodes[port]["unmade"] = True

    def connect(self, source: str, destination: str, delay: int | None, position: Position | None) -> None:
        """Add one connection between two ports."""
        hop = Hop(source, destination, delay, position, self._order)
        self._order += 1
        self._hops[hop.order] = hop
        self.ports.add_edge(source, destination, key=hop.order, hop=hop)
        self._outgoing.setdefault(source, []).append(hop)
        self._incoming.setdefault(destination, []).append(hop)

    @property
    def connections(self) -> int:
        """How many there are."""
        return len(self._hops)

    def disconnect(self, hop: Hop) -> None:
        """Take a connection out."""
        del self._hops[hop.order]
        self.ports.remove_edge(hop.source, hop.destination, key=hop.order)
        self._outgoing[hop.source].remove(hop)
        self._incoming[hop.destination].remove(hop)

    def mark(self) -> int:
        """Where the next connection will stand, for ``since``."""
        return self._order

    def since(self, mark: int) -> list[Hop]:
        """The connections that were made since a mark and are still there."""
        found = []
        for order in reversed(self._hops):
            if order < mark:
                break
            found.append(self._hops[order])
        return found[::-1]

    def size(self) -> tuple[Any, ...]:
        """How large it is, for ``shrink``."""
        flags = {name: getattr(self, name) for name in ("is_wired", "detours", "_order")}
        names = {name: set(getattr(self, name)) for name in ("empty_arrays", "unknown", "absent")}
        return len(self.ports), [len(known) for known in self._by_path()], flags | names

    def shrink(self, size: tuple[Any, ...]) -> None:
        """Take out what was added since it had that size."""
        ports, sizes, attributes = size
        for hop in self.since(attributes["_order"]):
            self.disconnect(hop)
        self.ports.remove_nodes_from(list(islice(self.ports, ports, None)))
        for actor in islice(self.actors.values(), sizes[0], None):
            actor.home = None
        for known, length in zip(self._by_path(), sizes, strict=True):
            while len(known) > length:
                known.popitem()
        for members in self.members.values():
            members[:] = [each for each in members if each in self.actors or each in self.clocks]
        for border in self._borders.values():
            for paths in border:
                paths[:] = [path for path in paths if path in self.ports]
        for name, value in attributes.items():
            setattr(self, name, value)

    def _by_path(self) -> tuple[dict[str, Any], ...]:
        """What is known of parts, the actors first."""
        return (
            self.actors, self.composites, self.positions, self.priorities, self.tags, self.clocks, self.members,
            self._borders,
        )  # fmt: skip

    def remove(self, path: str) -> None:
        """Take out an actor, or a composite and all within, with their connections."""

        def is_within(each: str) -> bool:
            return each == path or each.startswith(f"{path}.")

        for port in [each for each in self.ports if is_within(each)]:
            for hop in {*self.incoming(port), *self.outgoing(port)}:
                self.disconnect(hop)
            self.ports.remove_node(port)
        for actor in [each for each in self.actors if is_within(each)]:
            self.actors[actor].home = None
        for known in self._by_path():
            for each in [each for each in known if is_within(each)]:
                del known[each]
        for members in self.members.values():
            members[:] = [each for each in members if not is_within(each)]

    def direction(self, path: str) -> str:
        """``input`` or ``output``."""
        direction: str = self.ports.nodes[path]["direction"]
        return direction

    def type_of(self, path: str) -> Any:
        """The declared type of a port; None if a composite says nothing of it."""
        node = self.ports.nodes[path]
        return node.get("type") if node["port"] is None else node["port"].type

    def owner(self, port: str) -> str:
        """The actor or composite that a port belongs to."""
        return port.rpartition(".")[0]

    def director_of(self, path: str) -> str:
        """The innermost composite with a director that an actor or composite stands in; "" is the model itself."""
        around = path.rpartition(".")[0]
        while around not in self.clocks:
            around = around.rpartition(".")[0]
        return around

    def director_over(self, hop: Hop) -> str:
        """The director in whose time a connection stands: of the composite that declares it."""
        owner = self.owner(hop.source)
        # A connection from a composite's own input is declared inside of that composite.
        inside = owner in self.clocks and self.direction(hop.source) == "input"
        return owner if inside else self.director_of(owner)

    def borders(self, composite: str) -> tuple[list[str], list[str]]:
        """The inputs and outputs of a composite; the model itself has none."""
        return self._borders.get(composite, ([], []))

    def is_end(self, path: str) -> bool:
        """Whether a port belongs to something that fires, and tokens do not only pass through it."""
        owner = self.owner(path)
        return owner in self.clocks or (self.ports.nodes[path]["port"] is not None and owner not in self.composites)

    def outgoing(self, path: str) -> Sequence[Hop]:
        """The connections that leave a port, in the order of their declaration."""
        return self._outgoing.get(path, ())

    def incoming(self, path: str) -> Sequence[Hop]:
        """The connections that enter a port, in the order of their declaration."""
        return self._incoming.get(path, ())

    def wires_from(self, port: OutputPort[Any]) -> list[Wire]:
        """All wires that begin at an output port."""
        return [
            Wire(port, self.ports.nodes[hops[-1].destination]["port"], hops)
            for hops in self._ways(port.path, forward=True)
            if isinstance(self.ports.nodes[hops[-1].destination]["port"], InputPort)
        ]

    def wires_to(self, port: InputPort[Any]) -> list[Wire]:
        """All wires that end at an input port; their order is that of the port's channels."""
        return [
            Wire(self.ports.nodes[hops[0].source]["port"], port, hops)
            for hops in self._ways(port.path, forward=False)
            if isinstance(self.ports.nodes[hops[0].source]["port"], OutputPort)
        ]

    def _ways(self, path: str, *, forward: bool) -> Iterator[tuple[Hop, ...]]:
        """The ways from a port to actors' ports; ``check_passages`` has seen to it that they end."""
        for hop in self.outgoing(path) if forward else self.incoming(path):
            far = hop.destination if forward else hop.source
            if self.ports.nodes[far]["port"] is not None:
                yield (hop,)
                continue
            for rest in self._ways(far, forward=forward):
                yield (hop, *rest) if forward else (*rest, hop)

    def wires(self) -> Iterator[Wire]:
        """All wires of the model."""
        for actor in self.actors.values():
            for port in actor.outputs.values():
                yield from self.wires_from(port)

    def source_of(self, path: str) -> list[OutputPort[Any]]:
        """The actors' output ports behind a port: itself, or what feeds a composite's output."""
        found, seen, waiting = [], {path}, [path]
        while waiting:
            here = waiting.pop()
            port = self.ports.nodes[here]["port"]
            if isinstance(port, OutputPort):
                found.append(port)
            else:
                before = [hop.source for hop in self.incoming(here)]
                waiting += [each for each in reversed(before) if each not in seen]
                seen.update(before)
        return found

    def is_excused(self, pattern: str) -> bool:
        """Whether a pattern that matches nothing is right: it speaks of an empty array, or of what is not known."""
        return any(could_be_within(pattern, path, array=True) for path in self.empty_arrays) or any(
            could_be_within(pattern, path, array=False) for path in self.unknown
        )
