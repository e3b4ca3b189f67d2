"""Composites with modes: their machine, and the refinements of its modes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from epicycle.actors import declared_parameters

from ..text.document import Entry, Mapping
from ..text.kinds import MISSING_KEY, MODE
from ..text.problems import POISON, Poison, Position
from ..text.reading import NodeReader, Text
from .fields import AT, Field, Schema, names_of, node_as, one_or_more, ref
from .parts import PartText

_VALUES: Schema = {"type": ["object", "string"]}
_MODE: Schema = {"type": ["object", "null"], "properties": {"refinement": {"type": ["string", "object"]}}}
# What a composite class declares about its machine, if it has one: parameters of StateMachine, and refinements.
OF_MODES = {
    "modes": Field(
        node_as({"anyOf": [one_or_more(ref("name")), names_of(_MODE)]}),
        "The modes of a composite without other actors: a list of names, or 'name: {refinement, flow, entry, "
        "exit, final}'.",
    ),
    "transitions": Field(
        node_as({"type": "array", "items": {"type": ["string", "object"]}}),
        "Its transitions, such as 'a -> b on port after 3 s when x > 2 do y = x; n = n + 1', or {from, to, when, ...}.",
    ),
    "initial": Field(node_as({"type": "string"}), "The initial mode (default: the first)."),
    "variables": Field(
        node_as({"type": ["object", "string"]}), "Variables of its guards and actions: 'name: initial value'."
    ),
    "held": Field(
        node_as({"type": ["object", "string"]}), "Inputs that keep their latest token: 'name: initial value'."
    ),
}


def machine_of(
    reader: NodeReader, name: str, machine: dict[str, Entry], entries: dict[str, Entry], position: Position
) -> dict[str, Any]:
    """The machine of a composite with modes, and their refinements."""
    for key in ("actors", "connections"):
        if key in entries:
            hint = "move them into the refinement of a mode, or into a composite around this one"
            message = f"{name} has modes, so it cannot have {key}"
            reader.problems.add(message, entries[key].key.position, hint, kind=MODE)
    refinements: dict[str, PartText] = {}
    modes = machine.get("modes")
    if modes is not None and isinstance(modes.value, Mapping):
        left = {}
        for mode, entry in modes.value.entries.items():
            left[mode] = entry
            if isinstance(entry.value, Mapping):
                valid = (*declared_parameters(_mode()), "refinement")
                inner = dict(reader.entries(entry.value, f"mode {mode!r}", valid) or {})
                said = inner.pop("refinement", None)
                if said is not None and (refinement := _refinement(reader, mode, said)):
                    refinements[mode] = refinement
                left[mode] = replace(entry, value=replace(entry.value, entries=inner))
        machine["modes"] = replace(modes, value=replace(modes.value, entries=left))
    kind = Text("StateMachine", position)
    return {"machine": PartText("machine", position, kind, machine), "refinements": refinements}


def _mode() -> type:
    from epicycle.actors import Mode  # it imports the solvers of differential equations, which takes a while

    return Mode


def _refinement(reader: NodeReader, mode: str, entry: Entry) -> PartText | Poison:
    """A composite class by its name, or as ``{type: ..., <parameter>: ...}``."""
    values = dict(entry.value.entries) if isinstance(entry.value, Mapping) else {}
    said = values.pop("type", None) if isinstance(entry.value, Mapping) else entry
    if said is None:
        message = f"the refinement of {mode!r} has no type"
        return reader.problems.add(message, entry.key.position, "add 'type: ...'", kind=MISSING_KEY)
    kind: Text | Poison = AT.read(reader, said.value, f"the refinement of {mode!r}")
    taken = reader.texts(values.pop("inherit").value, "inherit") if "inherit" in values else ()
    return POISON if kind is POISON else PartText(mode, entry.key.position, kind, values, inherit=taken or ())
