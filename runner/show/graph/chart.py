"""Statecharts: the modes of a machine and its transitions, as an outline."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from epicycle.actors import EpicycleError, did_you_mean

from .outlines import FINAL, MODE, START, Box, Link, Outline, Port

if TYPE_CHECKING:
    from ...model.build.model import Model

WIDEST = 34  # letters in a line of a label
FLAGS = ("else", "immediate", "nondeterministic", "preemptive", "history", "error")


def statechart(model: Model, path: str) -> Outline:
    """The statechart of a machine, or of a composite with modes; raises ``EpicycleError`` if there are none."""
    from epicycle.actors import StateMachine

    machines = {each: actor for each, actor in model.graph.actors.items() if isinstance(actor, StateMachine)}
    found = machines.get(path) or machines.get(f"{path}.machine")
    if found is None:
        known = [each.removesuffix(".machine") for each in machines]
        valid = ", ".join(known) or "none"
        raise EpicycleError(f"{path} has no modes{did_you_mean(path, known)}; machines: {valid}")
    domain = model.graph.domains.get(found.path.rpartition(".")[0])
    refinements = {} if domain is None else domain.refinements
    modes: dict[str, Box] = {}
    for name, mode in found.modes.items():
        lines = [f"{variable}' = {formula.source}" for variable, formula in mode.flow.items()]
        lines += [f"{when} / {_actions(acts)}" for when, acts in (("entry", mode.entry), ("exit", mode.exit)) if acts]
        if name in refinements:
            lines.append(f"refinement {model.graph.components[refinements[name]].kind}")
        modes[name] = Box(f"{found.path}.{name}", name, _wrapped(lines), shape=FINAL if mode.final else MODE)
    labels: dict[tuple[str, str], list[str]] = {}
    for each in found.transitions:
        sources = each.from_
        if sources == ("*",):
            sources = tuple(name for name, mode in modes.items() if name != each.to and mode.shape != FINAL)
        for source in sources:
            labels.setdefault((source, each.to), []).append(_label(each))
    start, initial = Box(f"{found.path}.", "", "", shape=START), modes[found.initial or next(iter(modes))]
    links = [_link(start, initial, [])]
    links += [_link(modes[source], modes[target], said) for (source, target), said in labels.items()]
    whole = found.path.removesuffix(".machine")
    chart = Box(whole, whole, "modes", children=[start, *modes.values()], links=links, is_composite=True)
    return Outline(model, Box("", model.name, "", children=[chart], is_composite=True), 1, 1)


def _link(source: Box, target: Box, labels: list[str]) -> Link:
    """An arrow between two modes, with ports of its own."""
    ends = []
    for box, ports in ((source, source.outputs), (target, target.inputs)):
        ends.append(f"{box.path} {len(box.inputs) + len(box.outputs)}")
        ports.append(Port(ends[-1], "", False, ()))
    return Link(ends[0], ends[1], None, _wrapped(labels))


def _wrapped(texts: Iterable[str]) -> str:
    return "\n".join(line for each in texts for line in textwrap.wrap(each, WIDEST))


def _actions(actions: Any) -> str:
    return "; ".join(f"{name} = {formula.source}" for name, formula in actions)


def _label(each: Any) -> str:
    """A transition as UML writes it: trigger [guard] / actions."""
    flags = [flag for flag in FLAGS if vars(each)[flag]]
    words = [*flags, *([f"priority {each.priority}"] if each.priority else []), *each.on]
    words += [f"after {each.after.source} s"] if each.after is not None else []
    words += [f"probability {each.probability.source}"] if each.probability is not None else []
    words += [f"rate {each.rate.source}"] if each.rate is not None else []
    words += [f"[{each.when.source}]"] if each.when is not None else []
    return " ".join(words) + (f" / {_actions(each.do)}" if each.do else "")
