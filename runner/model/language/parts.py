"""Actors, aspects and figures: a type, values for its parameters, and what stands beside these."""

from __future__ import annotations

from dataclasses import dataclass, field

from epicycle.actors import Actor, Parameter, nearest
from epicycle.aspects import Aspect

from ..catalogue.figure import Figure
from ..text.document import Entry, Mapping, Node, Scalar
from ..text.kinds import MISSING_KEY
from ..text.limits import NORMAL
from ..text.problems import POISON, Fix, Poison, Position
from ..text.reading import NAME, SURE, NodeReader, Text, is_empty
from .fields import AT, TEXTS, Computed, Reader, Record, computed_as, keyed, named, one_or_more, ref, sound
from .places import POINTCUTS, PointcutText


@dataclass(frozen=True)
class PartText:
    """An actor, aspect or figure: a type and values for its parameters.

    In a class that extends another, the type may be empty, which leaves the inherited one.
    """

    name: str
    position: Position
    type: Text
    values: dict[str, Entry] = field(default_factory=dict)
    count: Computed | None = keyed(
        computed_as(Parameter(int, min=0, max=NORMAL.actors)),
        "The number of instances, name[0] to name[count - 1]; see 'index'.",
        default=None,
    )
    priority: Computed | None = keyed(
        computed_as(Parameter(int)),
        "Of two actors at the same tag and depth, the one with the smaller priority fires first.",
        default=None,
    )
    at: tuple[PointcutText | Poison, ...] = keyed(
        POINTCUTS,
        "Where it attaches: patterns of ports or actors, 'a.out -> b.in', {type, port}, {tag, port}; not at !pattern.",
        default=(),
    )
    tags: tuple[Text, ...] = keyed(
        TEXTS.described(one_or_more(ref("text"))),
        "Names by which aspects can select it: 'at: {tag: ...}'.",
        default=(),
    )
    inherit: tuple[Text, ...] = keyed(
        TEXTS.described(one_or_more(ref("text"))),
        "Parameters that take the values of those with the same names around it: 'all', or their names.",
        default=(),
    )
    enabled: Computed | None = keyed(
        computed_as(Parameter(bool)), "Whether it is active (default: true).", default=None
    )
    removes: bool = False  # it removes the inherited part with that name
    kept: frozenset[str] = frozenset()  # what a base of its class gives to a part of another type
    choices: dict[str, PartText] = field(default_factory=dict)  # what it may be, if a parameter chooses its type


BESIDE = Record.of(PartText)  # the keys besides the parameters of an actor or aspect
RESERVED = {
    "actor": Actor.reserved,
    "aspect": Aspect.reserved,
    "figure": Figure.reserved,
    "study_figure": frozenset({"type"}),
}


def beside(name: str, node: Node) -> Computed:
    """What may be computed for one of these keys."""
    found: Computed = BESIDE.keys[name].shape.read(None, node, name)
    return found


def part(
    reader: NodeReader, name: str, entry: Entry, kind: str, reserved: frozenset[str], derived: bool
) -> PartText | Poison:
    """``name: {type: ..., ...}``; in a class that extends another, ``type`` may be missing, or ``name: null``."""
    problems = reader.problems
    if derived and is_empty(entry.value):
        return PartText(name, entry.key.position, Text("", entry.key.position), removes=True)
    if not isinstance(entry.value, Mapping):
        said = entry.value.value if isinstance(entry.value, Scalar) else None
        type_said = said if isinstance(said, str) and NAME.match(said) else "..."
        hint = f"write '{name}: {{type: {type_said}}}' with the {kind}'s type and parameters"
        return problems.add(f"{kind} {name!r} is not a mapping", entry.value.position, hint)
    values = dict(entry.value.entries)
    kind_entry = values.pop("type", None)
    if (kind_entry is None and not derived) or (kind_entry is not None and is_empty(kind_entry.value)):
        meant = None if kind_entry is not None else nearest("type", values, SURE)
        near = f", did you mean 'type' by {meant!r}?" if meant is not None else ""
        at = entry.key if meant is None else values[meant].key
        fix = Fix(at.position, "type") if meant is not None else None
        hints = () if near else ("add 'type: ...'",)
        return problems.add(f"{kind} {name!r} has no type{near}", at.position, *hints, kind=MISSING_KEY, fix=fix)
    type_name = Text("", entry.key.position)
    if kind_entry is not None:
        said_type: Text | Poison = AT.read(reader, kind_entry.value, f"the type of {name!r}")
        if said_type is POISON:
            return POISON
        type_name = said_type
    beside = {key: values.pop(key).value for key in sorted(reserved) if key in values}
    read = {key: BESIDE.keys[key].shape.read(reader, node, key) for key, node in beside.items()}
    return PartText(name, entry.key.position, type_name, values, **sound(read))


def parts(kind: str, definition: str = "", *, derived: bool = False) -> Reader:
    """Actors, aspects or figures by name."""
    reserved = RESERVED.get(definition, RESERVED[kind])

    def read(reader: NodeReader, name: str, entry: Entry) -> PartText | Poison:
        return part(reader, name, entry, kind, reserved, derived)

    return named(ref(definition or kind), read)
