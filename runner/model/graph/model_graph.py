"""The model graph: every port of every actor and composite as a node, every connection as an edge.

Validation, scheduling, weaving and drawing read it.  A *wire* is a path through it from an actor's output port, through
any composite ports, to an actor's input port.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from epicycle.actors import Actor, InputPort, OutputPort, declared_ports, has_own_ports, paths
from epicycle.aspects import Request

from ..catalogue.dialect import Dialect
from ..text.limits import NORMAL, Limits
from ..text.patterns import could_be_within
from ..text.problems import Position
from .clock import Clock
from .nodes import Component, Detour, Domain, Edge, Gap, PortNode, Wire


class ModelGraph:
    """The flattened graph of one model, which is built and then frozen: to change it again, change a ``copy``.

    A part of a model is a graph, too, until it is merged; ``inside`` is then the graph that it will join, and
    ``director`` the director that it will be under.

    Each problem of a model is reported once, where it is found.  From then on it is a gap, about which nothing more is
    reported: a part that could not be made, a port that may be connected to anything, a connection that could not be
    understood.  The empty array of a valid model is a gap, too: it may be named although it has no instances.
    """

    def __init__(self, limits: Limits = NORMAL, inside: ModelGraph | None = None, director: str = "") -> None:
        self.ports: dict[str, PortNode] = {}
        self.actors: dict[str, Actor] = {}
        self.components: dict[str, Component] = {"": Component("")}  # outer ones first; "" is the model
        # Of the composites with their own director, which are actors in the graph around them, outer ones first.
        outer = None if inside is None else inside.domains[director]
        self.domains: dict[str, Domain] = {
            "": Domain(Clock(), Dialect) if outer is None else Domain(outer.clock, outer.dialect)
        }
        self.detours: list[Detour] = []  # found when the model is checked, see ``detours``
        self.gaps: dict[str, Gap] = {}  # by path; in a valid model, all of them are empty arrays
        self.fed: set[str] = set()  # inputs to which anything may be connected
        self.is_wired = True  # whether every connection has been made
        self.limits: Limits = limits if inside is None else inside.limits
        self.is_frozen = False
        self._shared: Collection[str] = ()  # actors that a frozen graph has, too
        self._channels: Channels | None = None  # worked out since then
        self._hops: dict[int, Edge] = {}  # in their order
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
        for path, node in self.ports.items():
            made.ports[path] = replace(node, incoming=[*node.incoming], outgoing=[*node.outgoing])
        made.actors, made.detours = dict(self.actors), [*self.detours]
        made.components = {path: each.copy() for path, each in self.components.items()}
        made.domains = {path: replace(each, members=[*each.members]) for path, each in self.domains.items()}
        made._hops, made._order = dict(self._hops), self._order
        made.gaps, made.fed, made.is_wired = dict(self.gaps), {*self.fed}, self.is_wired
        made._shared = {*self.actors} if self.is_frozen else self._shared
        return made

    def part(self, director: str) -> ModelGraph:
        """A part that is to be merged later, under a director of this graph."""
        return ModelGraph(inside=self, director=director)

    def merge(self, part: ModelGraph, director: str) -> None:
        """Take in a part that was made for this graph."""
        self._check_open()
        self.domains[director].members += part.domains.pop("").members
        for instances in part.components.pop("").parts.values():
            for path in instances:
                self._enrol(path)
        self.ports |= part.ports
        self.actors |= part.actors
        self.components |= part.components
        self.domains |= part.domains
        self._hops |= part._hops
        self._order = max(self._order, part._order)
        self.gaps |= part.gaps
        self.fed |= part.fed
        self.is_wired = self.is_wired and part.is_wired

    def add_actor(self, actor: Actor, position: Position | None) -> None:
        self._check_open()
        actor.is_part = True
        self.actors[actor.path] = actor
        self.add_component(actor.path, type(actor).__name__, position)
        self.domains[self.director_of(actor.path)].members.append(actor.path)
        ports: tuple[InputPort[Any] | OutputPort[Any], ...] = (*actor.inputs.values(), *actor.outputs.values())
        for port in ports:
            self.ports[port.path] = PortNode(port, port.direction)

    def add_component(self, path: str, kind: str, position: Position | None = None) -> None:
        """Add a composite of that class, or what an actor has in common with one."""
        self._check_open()
        self.components[path] = Component(kind, position)
        self._enrol(path)

    def _enrol(self, path: str) -> None:
        """Make something a part of what it is in; as long as this is a part itself, that may be elsewhere."""
        above, _, name = path.rpartition(".")
        around = self.components.get(above) or self.components[""]
        around.parts.setdefault(name.partition("[")[0], []).append(path)

    @property
    def composites(self) -> dict[str, Component]:
        """The composites, outer ones first."""
        return {path: each for path, each in self.components.items() if path and path not in self.actors}

    def is_composite(self, path: str) -> bool:
        """Whether this is the path of a composite."""
        return path in self.components and path not in self.actors and path != ""

    def position_of(self, path: str) -> Position | None:
        """Where an actor or composite is declared, if that is known."""
        return self.components[path].position if path in self.components else None

    def parts(self, composite: str) -> Mapping[str, list[str]]:
        """The actors and composites in a composite, by their names: of an array all instances."""
        found = self.components.get(composite)
        return {} if found is None else found.parts

    def add_director(
        self,
        path: str,
        start: int | None = None,
        drift: float = 1.0,
        like: type[Dialect] | None = None,
    ) -> None:
        """Give a composite its own director, with this clock (``start`` in ns), and a dialect (default: as outside)."""
        self._check_open()
        outer = self.domains[self.director_of(path)]
        outer.members.append(path)
        self.domains[path] = Domain(outer.clock.inside(start, drift), like or outer.dialect)

    def domain_of(self, path: str) -> Domain:
        """What the director over an actor or composite orders."""
        return self.domains[self.director_of(path)]

    def is_strict(self, composite: str) -> bool:
        """Whether this is a composite with a director, not a refinement, which counts as one actor in all respects."""
        if not composite or composite not in self.domains or self.refinement_of(composite) == composite:
            return False
        return self.domains[composite].dialect.is_strict

    def end_of(self, composite: str) -> str:
        """What has the rank behind everything in a strict composite."""
        return f"{composite}.(end)"

    def add_refinement(self, path: str) -> None:
        """Give a composite its own director, whose time advances in only one mode; clocks in it count that time."""
        self.add_director(path)
        self.domains[path].clock = Clock()

    def add_composite_port(self, path: str, direction: str, type: Any = None, declared: Position | None = None) -> None:
        """Add a port of a composite; tokens only pass through it, and have the ``type`` if there is one."""
        self._check_open()
        self.ports[path] = PortNode(None, direction, type, declared)
        self.components[paths.parent(path)].borders[direction == "output"].append(path)

    def open_requests(self, path: str) -> None:
        """Make an input of a composite the place where an aspect's requests come in: tokens start there."""
        self._check_open()
        port = OutputPort(Request, multi=True)
        port.name, port.path = paths.name(path), path
        self.ports[path].port = port

    def connect(
        self, source: str, destination: str, delay: int | None, position: Position | None, shared: int | None = None
    ) -> None:
        self._check_open()
        edge = self._hops[self._order] = Edge(source, destination, delay, position, self._order, shared=shared)
        self._order += 1
        self.ports[source].outgoing.append(edge)
        self.ports[destination].incoming.append(edge)

    @property
    def connections(self) -> int:
        return len(self._hops)

    def disconnect(self, edge: Edge) -> None:
        self._check_open()
        del self._hops[edge.order]
        self.ports[edge.source].outgoing.remove(edge)
        self.ports[edge.destination].incoming.remove(edge)

    @property
    def edges(self) -> Collection[Edge]:
        """All connections, in the order of their declaration."""
        return self._hops.values()

    @property
    def next_order(self) -> int:
        """The number of the next connection."""
        return self._order

    def remove(self, path: str) -> None:
        """Remove an actor, or a composite and its contents, with their connections."""
        self._check_open()
        for port in [each for each in self.ports if paths.is_within(each, path)]:
            for edge in {*self.incoming(port), *self.outgoing(port)}:
                self.disconnect(edge)
            del self.ports[port]
        above, _, name = path.rpartition(".")
        siblings = self.components[above].parts
        siblings[name.partition("[")[0]].remove(path)
        if not siblings[name.partition("[")[0]]:
            del siblings[name.partition("[")[0]]
        for gone in [each for each in self.components if paths.is_within(each, path)]:
            del self.components[gone]
            self.domains.pop(gone, None)
            if (actor := self.actors.pop(gone, None)) is not None:
                actor.is_part = gone in self._shared
        for domain in self.domains.values():
            domain.members[:] = [each for each in domain.members if not paths.is_within(each, path)]

    def direction(self, path: str) -> str:
        """``input`` or ``output``."""
        return self.ports[path].direction

    def type_of(self, path: str) -> Any:
        """The declared type of a port; None if a composite declares none."""
        node = self.ports[path]
        return node.type if node.port is None else node.port.type

    def director_of(self, path: str) -> str:
        """The innermost composite with a director that contains an actor or composite; "" is the model itself."""
        around = paths.parent(path)
        while around not in self.domains:
            around = paths.parent(around)
        return around

    def refinement_of(self, path: str) -> str:
        """The innermost refinement that this is in, or is; "" if there is none."""
        while path:
            above, _, mode = path.rpartition(".")
            if above in self.domains and mode in self.domains[above].refinements:
                break
            path = above
        return path

    def director_over(self, edge: Edge) -> str:
        """The director whose time applies to a connection: that of the composite that declares it."""
        owner = paths.parent(edge.source)
        # A connection from a composite's own input is declared inside that composite.
        inside = owner in self.domains and self.direction(edge.source) == "input"
        return owner if inside else self.director_of(owner)

    def borders(self, composite: str) -> tuple[list[str], list[str]]:
        """The inputs and outputs of a composite; the model itself has none."""
        found = self.components.get(composite)
        return ([], []) if found is None else found.borders

    def is_end(self, path: str) -> bool:
        """Whether a port belongs to something that fires, and tokens do not only pass through it."""
        owner = paths.parent(path)
        return owner in self.domains or owner in self.actors

    def outgoing(self, path: str) -> Sequence[Edge]:
        """The connections that leave a port, in the order of their declaration."""
        return self.ports[path].outgoing

    def incoming(self, path: str) -> Sequence[Edge]:
        """The connections that enter a port, in the order of their declaration."""
        return self.ports[path].incoming

    def wires_from(self, port: OutputPort[Any]) -> list[Wire]:
        """All wires that begin at an output port."""
        return [
            Wire(port, end, edges)
            for edges in self._ways(port.path, forward=True)
            if isinstance(end := self.ports[edges[-1].destination].port, InputPort)
        ]

    def wires_to(self, port: InputPort[Any]) -> list[Wire]:
        """All wires that end at an input port; their order is that of the port's channels."""
        return [
            Wire(start, port, edges)
            for edges in self._ways(port.path, forward=False)
            if isinstance(start := self.ports[edges[0].source].port, OutputPort)
        ]

    def channels_to(self, port: InputPort[Any]) -> list[list[Wire]]:
        """The wires that end at an input port, by the channel."""
        found: dict[object, list[Wire]] = {}
        for wire in self.wires_to(port):
            found.setdefault(self.channel_of(wire.edges, wire.edges[-1]), []).append(wire)
        return list(found.values())

    @property
    def channels(self) -> Channels:
        """The channels of all ports of a frozen graph."""
        if self._channels is None:
            if not self.is_frozen:
                raise RuntimeError("the channels of a graph that is not frozen may change")
            self._channels = Channels(self)
        return self._channels

    def channel_of(self, edges: tuple[Edge, ...], edge: Edge) -> object:
        """What distinguishes the channels of a port: the wire, or the connection at the port if that is one channel.

        What leaves a strict composite with modes is one channel, whichever refinement has sent it.
        """
        if edge.shared is not None:
            return edge.shared
        for place in range(len(edges), 0, -1):
            far = edges[place - 1].destination
            domain = self.domains.get(paths.parent(far))
            if domain is not None and domain.machine and domain.dialect.is_strict and self.direction(far) == "output":
                return edges[place:]
        return edges

    def _ways(self, path: str, *, forward: bool) -> Iterator[tuple[Edge, ...]]:
        """The paths from a port to actors' ports; ``check_passages`` has made sure that they end."""
        for edge in self.outgoing(path) if forward else self.incoming(path):
            far = edge.destination if forward else edge.source
            if self.ports[far].port is not None:
                yield (edge,)
                continue
            for rest in self._ways(far, forward=forward):
                yield (edge, *rest) if forward else (*rest, edge)

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
                before = [edge.source for edge in self.incoming(here)]
                waiting += [each for each in reversed(before) if each not in seen]
                seen.update(before)
        return found

    # -- gaps -----------------------------------------------------------------------------------------------------

    def leave_out(self, path: str, actor_type: type[Actor]) -> None:
        """Add the ports of an actor that could not be made, so that references to them are not wrong, too."""
        for name, port in declared_ports(actor_type).items():
            self.ports[f"{path}.{name}"] = PortNode(None, port.direction)
            self.fed.add(f"{path}.{name}")
        self.gaps[path] = Gap(frozenset({actor_type.__name__}), has_own_ports(actor_type))

    def leave_open(self, composite: str) -> None:
        """Report nothing more about what comes into a composite."""
        self.fed.update(self.borders(composite)[0])

    @property
    def missing_kinds(self) -> set[str]:
        """The types and tags of what is missing."""
        return set[str]().union(*(gap.kinds for gap in self.gaps.values()))

    def may_hold(self, kind: str, scope: str) -> bool:
        """Whether there may be a part of that type, or with that tag, in a composite."""
        inside = (path for path, gap in self.gaps.items() if gap.is_open and not gap.is_empty)
        return kind in self.missing_kinds or any(not scope or path.startswith(f"{scope}.") for path in inside)

    def excuses(self, pattern: str) -> bool:
        """Whether a pattern may match nothing: it names an empty array, or something unknown."""
        return any(could_be_within(pattern, path, array=gap.is_empty) for path, gap in self.gaps.items() if gap.is_open)

    def may_be_fed(self, ports: Iterable[str]) -> bool:
        """Whether a connection to one of these inputs may be missing because of another problem."""
        return not self.is_wired or not self.fed.isdisjoint(ports)


class Channels:
    """The channels of all ports of a graph: their wires, on both sides, in the order of declaration.

    Ports of composites on the way neither add nor merge any.  Where a connection is shared, all wires over it are one.
    Most wires are one connection between two ports that have no other; what follows from it is not kept.
    """

    def __init__(self, graph: ModelGraph) -> None:
        self._graph = graph
        self._widths: dict[str, int] = {}  # of inputs
        self._at: dict[tuple[Edge, ...], int] = {}  # the channel of each wire at its end
        self._leaving: dict[str, list[list[tuple[Edge, ...]]]] = {}  # the wires of each output by channel
        leaving: dict[str, list[tuple[Edge, ...]]] = {}
        for actor in graph.actors.values():
            for port in actor.inputs.values():
                channels = graph.channels_to(port)
                if len(channels) != bool(graph.incoming(port.path)):
                    self._widths[port.path] = len(channels)
                for channel, wires in enumerate(channels):
                    for wire in wires:
                        if channel:
                            self._at[wire.edges] = channel
                        leaving.setdefault(wire.source.path, []).append(wire.edges)
        for path in (port.path for actor in graph.actors.values() for port in actor.outputs.values()):
            ways = leaving.get(path, [])
            if [(edge,) for edge in graph.outgoing(path)] == ways[:1]:
                continue
            ways.sort(key=lambda way: [edge.order for edge in way])
            found: dict[object, list[tuple[Edge, ...]]] = {}
            for edges in ways:
                found.setdefault(graph.channel_of(edges, edges[0]), []).append(edges)
            self._leaving[path] = list(found.values())

    def width(self, path: str) -> int:
        """The number of channels of an input."""
        return self._widths.get(path, 1 if self._graph.incoming(path) else 0)

    def of(self, edges: tuple[Edge, ...]) -> int:
        """The channel of a wire at its end."""
        return self._at.get(edges, 0)

    def leaving(self, path: str) -> list[list[tuple[Edge, ...]]]:
        """The wires that leave an output, by channel."""
        found = self._leaving.get(path)
        return [[(edge,)] for edge in self._graph.outgoing(path)] if found is None else found
