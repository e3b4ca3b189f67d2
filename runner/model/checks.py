"""What must hold of a whole model before it runs."""

from __future__ import annotations

import networkx as nx

from epicycle.actors import accepts, type_name

from .graph import ModelGraph
from .problems import Position, Problems


def check(graph: ModelGraph, problems: Problems) -> None:
    """Add every problem of wiring: types, missing connections, two writers, loops without delay."""
    check_types(graph, problems)
    check_connections(graph, problems)
    check_loops(graph, problems)


def check_types(graph: ModelGraph, problems: Problems) -> None:
    """Every wire's sender must send what its receiver takes."""
    for wire in graph.wires():
        given, wanted = wire.source.type, wire.destination.type
        if accepts(wanted, given):
            continue
        way = " -> ".join([wire.hops[0].source, *(hop.destination for hop in wire.hops)])
        problems.add(
            f"{wire.source.path} sends {type_name(given)}, but {wire.destination.path} takes {type_name(wanted)}",
            wire.hops[0].position,
            *((f"the way: {way}",) if len(wire.hops) > 1 else ()),
            *_other_position(wire.hops[0].position, wire.hops[-1].position),
        )


def _other_position(first: Position | None, last: Position | None) -> tuple[str, ...]:
    if first is None or last is None or first == last:
        return ()
    return (f"connected onward at {last.file}:{last.line}:{last.column}",)


def check_connections(graph: ModelGraph, problems: Problems) -> None:
    """Required inputs are connected, and single inputs have one writer."""
    for actor in graph.actors.values():
        position = graph.positions.get(actor.path)
        for port in actor.inputs.values():
            wires = graph.wires_to(port)
            if not wires and port.required:
                problems.add(
                    f"{port.path} is not connected, and {type(actor).__name__} cannot do without it",
                    position,
                    *_open_end(graph, port.path),
                    f"it takes {type_name(port.type)}"
                    + (f": {port.doc}" if port.doc else ""),
                )
            if len(wires) > 1 and not port.multi:
                writers = ", ".join(wire.source.path for wire in wires)
                problems.add(
                    f"{port.path} takes one connection, but {len(wires)} senders write to it: {writers}",
                    wires[1].hops[0].position,
                    "send through an actor that merges them",
                )


def _open_end(graph: ModelGraph, path: str) -> tuple[str, ...]:
    """Where a chain of composite ports that leads to an unconnected input begins."""
    end = path
    while incoming := graph.incoming(end):
        end = incoming[0].source
    return (f"nothing is connected to {end}, which leads to it",) if end != path else ()


def check_loops(graph: ModelGraph, problems: Problems) -> None:
    """Every loop needs a delay somewhere, or no order of firing exists within a tag."""
    dependencies = graph.immediate_dependencies()
    for component in nx.strongly_connected_components(dependencies):
        if len(component) < 2:
            continue
        inner = dependencies.subgraph(component)
        cycle = nx.find_cycle(inner, source=min(component))
        wires = [inner.edges[edge]["wire"] for edge in cycle if "wire" in inner.edges[edge]]
        actors = [wire.source.actor.path for wire in wires]
        steps = []
        for wire in wires:
            hop = wire.hops[0]
            where = f" ({hop.position.file}:{hop.position.line})" if hop.position else ""
            steps.append(f"{wire.source.path} -> {wire.destination.path}{where}")
        last = wires[-1]
        problems.add(
            f"a loop without delay: {' -> '.join([*actors, actors[0]])}",
            last.hops[0].position,
            *steps,
            "give one of these connections a delay, for example "
            f"{{from: {last.hops[0].source}, to: {last.hops[0].destination}, delay: ...}}",
        )
