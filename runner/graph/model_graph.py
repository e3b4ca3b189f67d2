"""The model graph: every port of every actor and composite as a node, every connection as an edge.

Validation, scheduling, weaving and drawing read it.  A *wire* is a path through it from an actor's output port, through
any composite ports, to an actor's input port.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from typing import Any

from epicycle.actors import Actor, InputPort, OutputPort
from epicycle.aspects import Request

from ..catalogue.dialect import Dialect
from ..text.limits import NORMAL, Limits
from ..text.problems import Position
from .acts import connection_place
from .clock import Clock


@dataclass(frozen=True, eq=False)
class Hop:
    """One edge of the graph: a connection between two ports, as declared."""

    source: str
    destination: str
    delay: int | None  # ns; None: within the tag
    position: Position | None
    order: int
    shared: int | None = field(default=None, kw_only=True)  # the same for all hops of a connection that is one channel

    def __str__(self) -> str:
        return connection_place(self.source, self.destination)


@dataclass(frozen=True)
class Wire:
    """A path from an output port to an input port."""

    source: OutputPort[Any]
    destination: InputPort[Any]
    hops: tuple[Hop, ...]


@dataclass(frozen=True, eq=False)
class Detour(Hop):
    """A part of the path of tokens through an aspect that is a model, within the tag: it orders firings.

    Tokens go from their sender to the composite's request port, and from its response port to their destination.  If it
    ``waits`` for the composite's turn, it orders nothing.
    """

    aspect: str
    waits: bool = False


@dataclass(frozen=True)
class Modal:
    """A composite with modes whose machine has refinements: their paths, by the mode."""

    machine: str
    refinements: Mapping[str, str]


@dataclass(slots=True)
class PortNode:
    """A port in the graph: an actor's, or one of a composite (``port`` is None) that tokens only pass through."""

    port: InputPort[Any] | OutputPort[Any] | None
    direction: str  # input or output
    type: Any = None  # the type of what a composite's port hands on, if it declares one
    declared: Position | None = None


class ModelGraph:
    """The flattened graph of one model, which is built and then frozen: to change it again, change a ``copy``.

    A part of a model is a graph, too, until it is merged; ``inside`` is then the graph that it will join, and
    ``director`` the director that it will be under.
    """

    def __init__(self, limits: Limits = NORMAL, inside: ModelGraph | None = None, director: str = "") -> None:
        self.ports: dict[str, PortNode] = {}
        self.actors: dict[str, Actor] = {}
        self.composites: dict[str, str] = {}  # the class of each composite, outer ones first
        # The composites with their own director, which are actors in the graph around them; "" is the model.
        self.clocks: dict[str, Clock] = {"": Clock() if inside is None else inside.clocks[director]}
        # The dialect of each of these directors.
        self.dialects: dict[str, type[Dialect]] = {"": Dialect if inside is None else inside.dialects[director]}
        self.members: dict[str, list[str]] = {"": []}  # what each director fires, in the order of declaration
        self.modal: dict[str, Modal] = {}  # composites with modes, by their path
        self.priorities: dict[str, int] = {}
        self.positions: dict[str, Position] = {}  # also of "aspect NAME"
        self.tags: dict[str, tuple[str, ...]] = {}  # the tags that the model's author gave to actors and composites
        self.detours: list[Detour] = []  # found when the model is checked, see ``detours``
        self.limits: Limits = limits if inside is None else inside.limits
        self.is_frozen = False
        self._channels: Channels | None = None  # worked out since then
        self._outgoing: dict[str, list[Hop]] = {}  # of each port, in their order
        self._incoming: dict[str, list[Hop]] = {}
        self._borders: dict[str, tuple[list[str], list[str]]] = {}
        self._parts: dict[str, dict[str, list[str]]] = {}
        self._hops: dict[int, Hop] = {}  # in their order
        self._order: int = 0 if inside is None else inside._order

    def freeze(self) -> None:
        """Freeze it for running: nothing may change it afterwards."""
        self.is_frozen = True

    def _check_open(self) -> None:
        if self.is_frozen:
            raise RuntimeError("a frozen graph cannot be changed: change a copy")

    def copy(self) -> ModelGraph:
        """A copy that can be changed, with the same actors."""
        made = ModelGraph(self.limits)
        for name, value in vars(self).items():
            setattr(made, name, copy(value))
        made.ports = {path: copy(node) for path, node in self.ports.items()}
        made.is_frozen, made._channels = False, None
        made.members = {path: [*each] for path, each in self.members.items()}
        made._outgoing = {path: [*hops] for path, hops in self._outgoing.items()}
        made._incoming = {path: [*hops] for path, hops in self._incoming.items()}
        made._borders = {path: ([*inputs], [*outputs]) for path, (inputs, outputs) in self._borders.items()}
        made._parts = {path: {name: [*each] for name, each in parts.items()} for path, parts in self._parts.items()}
        return made

    def merge(self, part: ModelGraph, director: str) -> None:
        """Take in a part that was made for this graph."""
        self._check_open()
        self.ports |= part.ports
        self.members[director] += part.members.pop("")
        del part.clocks[""], part.dialects[""]
        parts = part._parts
        part._parts = {path: each for path, each in parts.items() if path not in self._parts}
        for known, new in zip(self._by_path(), part._by_path(), strict=True):
            known |= new
        for path in parts.keys() - part._parts.keys():  # the one that it is in
            for name, instances in parts[path].items():
                self._parts[path].setdefault(name, []).extend(instances)
        for hop in part._hops.values():
            self._enter(hop)

    def add_actor(self, actor: Actor, position: Position | None) -> None:
        self._check_open()
        actor.is_part = True
        self.actors[actor.path] = actor
        self._enrol(actor.path)
        self.members[self.director_of(actor.path)].append(actor.path)
        if position is not None:
            self.positions[actor.path] = position
        ports: tuple[InputPort[Any] | OutputPort[Any], ...] = (*actor.inputs.values(), *actor.outputs.values())
        for port in ports:
            self.ports[port.path] = PortNode(port, port.direction)

    def add_composite(self, path: str, kind: str) -> None:
        """Add a composite, of that class."""
        self._check_open()
        self.composites[path] = kind
        self._enrol(path)

    def _enrol(self, path: str) -> None:
        above, _, name = path.rpartition(".")
        self._parts.setdefault(above, {}).setdefault(name.partition("[")[0], []).append(path)

    def parts(self, composite: str) -> Mapping[str, list[str]]:
        """The actors and composites in a composite, by their names: of an array all instances."""
        return self._parts.get(composite, {})

    def add_director(
        self,
        path: str,
        start: int | None = None,
        drift: float = 1.0,
        like: type[Dialect] | None = None,
    ) -> None:
        """Give a composite its own director, with this clock (``start`` in ns), and a dialect (default: as outside)."""
        self._check_open()
        outer = self.director_of(path)
        self.members[outer].append(path)
        self.members[path] = []
        self.clocks[path] = self.clocks[outer].inside(start, drift)
        self.dialects[path] = like or self.dialects[outer]

    def dialect_at(self, path: str) -> type[Dialect]:
        """The dialect of the director of an actor or composite."""
        return self.dialects[self.director_of(path)]

    def is_strict(self, composite: str) -> bool:
        """Whether this is a composite with a director, not a refinement, which counts as one actor in all respects."""
        if not composite or composite not in self.dialects or self.refinement_of(composite) == composite:
            return False
        return self.dialects[composite].is_strict

    def end_of(self, composite: str) -> str:
        """What has the rank behind everything in a strict composite."""
        return f"{composite}.(end)"

    def add_refinement(self, path: str) -> None:
        """Give a composite its own director, whose time advances in only one mode; clocks in it count that time."""
        self.add_director(path)
        self.clocks[path] = Clock()

    def add_composite_port(
        self, path: str, direction: str, position: Position | None, type: Any = None, declared: Position | None = None
    ) -> None:
        """Add a port of a composite; tokens only pass through it, and have the ``type`` if there is one."""
        self._check_open()
        self.ports[path] = PortNode(None, direction, type, declared)
        self._borders.setdefault(self.owner(path), ([], []))[direction == "output"].append(path)
        if position is not None:
            self.positions[path] = position

    def open_requests(self, path: str) -> None:
        """Make an input of a composite the place where an aspect's requests come in: tokens start there."""
        self._check_open()
        port = OutputPort(Request, multi=True)
        port.name, port.path = path.rpartition(".")[2], path
        self.ports[path].port = port

    def connect(
        self, source: str, destination: str, delay: int | None, position: Position | None, shared: int | None = None
    ) -> None:
        self._check_open()
        self._enter(Hop(source, destination, delay, position, self._order, shared=shared))

    def _enter(self, hop: Hop) -> None:
        self._order = hop.order + 1
        self._hops[hop.order] = hop
        self._outgoing.setdefault(hop.source, []).append(hop)
        self._incoming.setdefault(hop.destination, []).append(hop)

    @property
    def connections(self) -> int:
        return len(self._hops)

    def disconnect(self, hop: Hop) -> None:
        self._check_open()
        del self._hops[hop.order]
        self._outgoing[hop.source].remove(hop)
        self._incoming[hop.destination].remove(hop)

    @property
    def hops(self) -> Collection[Hop]:
        """All connections, in the order of their declaration."""
        return self._hops.values()

    @property
    def next_order(self) -> int:
        """The number of the next connection."""
        return self._order

    def _by_path(self) -> tuple[dict[str, Any], ...]:
        """The properties of parts, actors first."""
        return (
            self.actors, self.composites, self.positions, self.priorities, self.tags, self.clocks, self.members,
            self._borders, self._parts, self.modal, self.dialects,
        )  # fmt: skip

    def remove(self, path: str) -> None:
        """Remove an actor, or a composite and its contents, with their connections."""
        self._check_open()
        for port in [each for each in self.ports if is_within(each, path)]:
            for hop in {*self.incoming(port), *self.outgoing(port)}:
                self.disconnect(hop)
            del self.ports[port]
        for actor in [each for each in self.actors if is_within(each, path)]:
            self.actors[actor].is_part = False
        for known in self._by_path():
            for each in [each for each in known if is_within(each, path)]:
                del known[each]
        for members in self.members.values():
            members[:] = [each for each in members if not is_within(each, path)]
        above, _, name = path.rpartition(".")
        instances = self._parts[above][name.partition("[")[0]]
        instances.remove(path)
        if not instances:
            del self._parts[above][name.partition("[")[0]]

    def direction(self, path: str) -> str:
        """``input`` or ``output``."""
        return self.ports[path].direction

    def type_of(self, path: str) -> Any:
        """The declared type of a port; None if a composite declares none."""
        node = self.ports[path]
        return node.type if node.port is None else node.port.type

    def owner(self, port: str) -> str:
        """The actor or composite that a port belongs to."""
        return port.rpartition(".")[0]

    def director_of(self, path: str) -> str:
        """The innermost composite with a director that contains an actor or composite; "" is the model itself."""
        around = path.rpartition(".")[0]
        while around not in self.clocks:
            around = around.rpartition(".")[0]
        return around

    def refinement_of(self, path: str) -> str:
        """The innermost refinement that this is in, or is; "" if there is none."""
        if not self.modal:
            return ""
        refinements = {each for modal in self.modal.values() for each in modal.refinements.values()}
        while path and path not in refinements:
            path = path.rpartition(".")[0]
        return path

    def director_over(self, hop: Hop) -> str:
        """The director whose time applies to a connection: that of the composite that declares it."""
        owner = self.owner(hop.source)
        # A connection from a composite's own input is declared inside that composite.
        inside = owner in self.clocks and self.direction(hop.source) == "input"
        return owner if inside else self.director_of(owner)

    def borders(self, composite: str) -> tuple[list[str], list[str]]:
        """The inputs and outputs of a composite; the model itself has none."""
        return self._borders.get(composite, ([], []))

    def is_end(self, path: str) -> bool:
        """Whether a port belongs to something that fires, and tokens do not only pass through it."""
        owner = self.owner(path)
        return owner in self.clocks or (self.ports[path].port is not None and owner not in self.composites)

    def outgoing(self, path: str) -> Sequence[Hop]:
        """The connections that leave a port, in the order of their declaration."""
        return self._outgoing.get(path, ())

    def incoming(self, path: str) -> Sequence[Hop]:
        """The connections that enter a port, in the order of their declaration."""
        return self._incoming.get(path, ())

    def wires_from(self, port: OutputPort[Any]) -> list[Wire]:
        """All wires that begin at an output port."""
        return [
            Wire(port, end, hops)
            for hops in self._ways(port.path, forward=True)
            if isinstance(end := self.ports[hops[-1].destination].port, InputPort)
        ]

    def wires_to(self, port: InputPort[Any]) -> list[Wire]:
        """All wires that end at an input port; their order is that of the port's channels."""
        return [
            Wire(start, port, hops)
            for hops in self._ways(port.path, forward=False)
            if isinstance(start := self.ports[hops[0].source].port, OutputPort)
        ]

    def channels_to(self, port: InputPort[Any]) -> list[list[Wire]]:
        """The wires that end at an input port, by the channel."""
        found: dict[object, list[Wire]] = {}
        for wire in self.wires_to(port):
            found.setdefault(self.channel_of(wire.hops, wire.hops[-1]), []).append(wire)
        return list(found.values())

    @property
    def channels(self) -> Channels:
        """The channels of all ports of a frozen graph."""
        if self._channels is None:
            if not self.is_frozen:
                raise RuntimeError("the channels of a graph that is not frozen may change")
            self._channels = Channels(self)
        return self._channels

    def channel_of(self, hops: tuple[Hop, ...], hop: Hop) -> object:
        """What distinguishes the channels of a port: the wire, or the connection at the port if that is one channel.

        What leaves a strict composite with modes is one channel, whichever refinement has sent it.
        """
        if hop.shared is not None:
            return hop.shared
        for place in range(len(hops), 0, -1) if self.modal else ():
            far = hops[place - 1].destination
            owner = self.owner(far)
            if owner in self.modal and self.direction(far) == "output" and self.dialects[owner].is_strict:
                return hops[place:]
        return hops

    def _ways(self, path: str, *, forward: bool) -> Iterator[tuple[Hop, ...]]:
        """The paths from a port to actors' ports; ``check_passages`` has made sure that they end."""
        for hop in self.outgoing(path) if forward else self.incoming(path):
            far = hop.destination if forward else hop.source
            if self.ports[far].port is not None:
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
            port = self.ports[here].port
            if isinstance(port, OutputPort):
                found.append(port)
            else:
                before = [hop.source for hop in self.incoming(here)]
                waiting += [each for each in reversed(before) if each not in seen]
                seen.update(before)
        return found


class Channels:
    """The channels of all ports of a graph: their wires, on both sides, in the order of declaration.

    Ports of composites on the way neither add nor merge any.  Where a connection is shared, all wires over it are one.
    Most wires are one connection between two ports that have no other; what follows from it is not kept.
    """

    def __init__(self, graph: ModelGraph) -> None:
        self._graph = graph
        self._widths: dict[str, int] = {}  # of inputs
        self._at: dict[tuple[Hop, ...], int] = {}  # the channel of each wire at its end
        self._leaving: dict[str, list[list[tuple[Hop, ...]]]] = {}  # the wires of each output by channel
        leaving: dict[str, list[tuple[Hop, ...]]] = {}
        for actor in graph.actors.values():
            for port in actor.inputs.values():
                channels = graph.channels_to(port)
                if len(channels) != bool(graph.incoming(port.path)):
                    self._widths[port.path] = len(channels)
                for channel, wires in enumerate(channels):
                    for wire in wires:
                        if channel:
                            self._at[wire.hops] = channel
                        leaving.setdefault(wire.source.path, []).append(wire.hops)
        for path in (port.path for actor in graph.actors.values() for port in actor.outputs.values()):
            ways = leaving.get(path, [])
            if [(hop,) for hop in graph.outgoing(path)] == ways[:1]:
                continue
            ways.sort(key=lambda way: [hop.order for hop in way])
            found: dict[object, list[tuple[Hop, ...]]] = {}
            for hops in ways:
                found.setdefault(graph.channel_of(hops, hops[0]), []).append(hops)
            self._leaving[path] = list(found.values())

    def width(self, path: str) -> int:
        """The number of channels of an input."""
        return self._widths.get(path, 1 if self._graph.incoming(path) else 0)

    def of(self, hops: tuple[Hop, ...]) -> int:
        """The channel of a wire at its end."""
        return self._at.get(hops, 0)

    def leaving(self, path: str) -> list[list[tuple[Hop, ...]]]:
        """The wires that leave an output, by channel."""
        found = self._leaving.get(path)
        return [[(hop,)] for hop in self._graph.outgoing(path)] if found is None else found


def is_within(path: str, outer: str) -> bool:
    """Whether a path is that of a part or of something in it."""
    return path == outer or path.startswith(f"{outer}.")
