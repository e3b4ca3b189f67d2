"""The wires of a composite with modes: between its ports, its machine and the refinements, by their names."""

from __future__ import annotations

from collections.abc import Mapping

from epicycle.actors import did_you_mean

from ..graph.model_graph import ModelGraph
from ..graph.nodes import Gap
from ..language.models import CompositeText
from ..text.kinds import ODD
from ..text.problems import Poison, Problems


def connect_modes(
    path: str,
    composite: CompositeText,
    classes: Mapping[str, CompositeText | Poison],
    graph: ModelGraph,
    problems: Problems,
) -> None:
    """Connect what has the same name, and report what cannot be connected.

    An input of the composite leads to the machine and to all refinements that have it; an output comes from the part
    that has it.  The machine's guards know what refinements send.  An input of a refinement with the name of a variable
    gets its value whenever a mode is entered.
    """
    from epicycle.actors import StateMachine  # it imports the solvers of differential equations, which takes a while

    name = composite.name
    assert composite.machine is not None
    part = composite.machine
    machine = graph.actors.get(f"{path}.{part.name}")
    if not isinstance(machine, StateMachine):  # which has been reported
        graph.leave_open(path)
        graph.gaps[path] = Gap()
        return

    at = part.values["transitions"].key.position if "transitions" in part.values else part.position

    def join(source: str, destination: str, delay: int | None = None) -> None:
        graph.connect(f"{path}.{source}", f"{path}.{destination}", delay, part.position)

    def tell(message: str, *hints: str) -> None:
        problems.add(f"{path}: {message}", at, *hints, scope=path)

    refinements = {
        mode: found for mode, each in composite.refinements.items() if (found := classes.get(each.type.text))
    }
    heard = {port for each in refinements.values() for port in each.outputs}
    read, handed = set[str](), list[str]()
    for port in machine.inputs:
        if port in composite.inputs:
            join(port, f"{part.name}.{port}")
        elif port in heard:
            for mode, each in refinements.items():
                if port in each.outputs:
                    join(f"{mode}.{port}", f"{part.name}.{port}")
        elif port != "trigger":
            known = [*composite.inputs, *heard]
            what = f"which is neither an input of {name}, nor a variable, nor an output of a refinement"
            tell(f"its transitions use {port!r}, {what}{did_you_mean(port, known)}", f"known: {', '.join(known)}")
        read.add(port)
    for port in machine.outputs:
        if port in composite.outputs:
            join(f"{part.name}.{port}", port)
        elif port not in machine.variables:
            near = did_you_mean(port, composite.outputs)
            valid = ", ".join(composite.outputs)
            tell(f"its transitions send from {port!r}, which is not an output of {name}{near}", f"outputs: {valid}")
    for mode, each in refinements.items():
        for port in each.inputs:
            if port in composite.inputs:
                join(port, f"{mode}.{port}")
                read.add(port)
            elif port in machine.variables:
                join(f"{part.name}.{port}", f"{mode}.{port}", 0)
                handed.append(port)
            else:
                known = [*composite.inputs, *machine.variables]
                near = did_you_mean(port, known)
                tell(
                    f"the refinement of {mode!r} has an input {port!r}, which is neither an input of {name} nor a "
                    f"variable{near}",
                    f"known: {', '.join(known) or 'none'}",
                )
        for port in each.outputs:
            if port in composite.outputs and port != "mode":
                join(f"{mode}.{port}", port)
    machine.handed = tuple(dict.fromkeys(handed))
    for port, said in composite.inputs.items():
        if port not in read:
            problems.warn(f"{path}: no mode reads the input {port!r} of {name}", said.position, kind=ODD)
