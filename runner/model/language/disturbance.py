"""Disturbances: aspects in separate files, which are added to a model from outside."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import TypeVar

from ..catalogue.packaged import find
from ..text.document import Mapping, Node, read
from ..text.kinds import FILE, FORM
from ..text.problems import POISON, Problems
from ..text.reading import NodeReader
from .acts import ACTS, ActText, acts
from .fields import NAMED, Field, Record, sound
from .models import ASPECTS, COMPOSITES, DOC, PARAMETERS, CompositeText, ModelText
from .parts import parts
from .ports import ParameterText
from .settings import Setting, put_aspect, settings_like
from .usage import check_own_usage


@dataclass(frozen=True)
class Disturbance:
    """A file of aspects, with parameters and classes of their own and values for parameters of the model."""

    text: CompositeText
    composites: dict[str, CompositeText] = field(default_factory=dict)
    settings: tuple[Setting, ...] = ()
    exactly: tuple[ActText, ...] | None = None


EXACTLY = "exactly"
T = TypeVar("T", CompositeText, ParameterText)
PARAMETER_THERE, COMPOSITE_THERE = "the model already has a parameter {!r}", "there is already a composite {!r}"

# Its aspects may take over the ports of the aspects that they replace.
DISTURBANCE = Record(
    "Aspects in a separate file, to be added to a model.",
    {
        "disturbance": Field(
            NAMED,
            "The name of the disturbance.",
            "the disturbance's name",
            missing=("the disturbance has no name", "begin the file with a line like 'disturbance: my_disturbance'"),
            name="name",
        ),
        "doc": DOC,
        "set": Field(
            settings_like("observer[*].sensor.max_range: 5 m"),
            "Values for parameters of the model: 'path: value', as for --set.",
        ),
        "parameters": PARAMETERS,
        "composites": COMPOSITES,
        "aspects": Field(parts("aspect", "added_aspect"), ASPECTS.doc),
        EXACTLY: Field(
            ACTS,
            "The only acts of aspects that happen, these and the model's own: a list of {aspect, at, token}.",
        ),
    },
)


def load_disturbance(name: str, problems: Problems) -> Disturbance | None:
    """A disturbance by its name or path; None if it cannot be read at all."""
    path = find(name, "disturbance", problems)
    node = None if path is None else read(path, problems)
    if node is None:
        return None
    with problems.looking_for(FORM):
        return _declared(node, problems)


def _declared(node: Node, problems: Problems) -> Disturbance | None:
    """What a file declares; anything malformed is reported and left out."""
    if isinstance(node, Mapping) and "model" in node.entries and "disturbance" not in node.entries:
        hint = "a disturbance begins with a line like 'disturbance: my_disturbance'"
        message, at = f"{node.position.file} is a model, not a disturbance", node.entries["model"].key.position
        problems.add(message, at, hint, kind=FILE)
        return None
    reader = NodeReader(problems)
    entries = DISTURBANCE.entries(reader, node, "the disturbance")
    if entries is POISON:
        return None
    before = len(problems)
    said = sound(DISTURBANCE.values(reader, entries, "the disturbance", node.position))
    composites, settings, exactly = said.pop("composites", {}), said.pop("set", ()), said.pop(EXACTLY, None)
    own = tuple(entry.value for key, entry in entries.items() if key != "composites")
    written = (*own, POISON) if len(problems) > before else own
    text = CompositeText(said.pop("name", "disturbance"), node.position, **said, written=written)
    check_own_usage(text, problems)
    return Disturbance(text, composites, settings, exactly)


def load_disturbances(names: Iterable[str], problems: Problems) -> list[Disturbance]:
    """Disturbances by their names or paths."""
    found: dict[str, Disturbance | None] = {}
    for name in names:
        if name in found:
            problems.add(f"the disturbance {name} is given twice", None, "leave one of them out")
        else:
            found[name] = load_disturbance(name, problems)
    return [disturbance for disturbance in found.values() if disturbance is not None]


def add_disturbances(
    text: ModelText, disturbances: Iterable[Disturbance], problems: Problems
) -> tuple[ModelText, list[Setting]]:
    """A model with the contents of disturbances, and the values that they set for the model's parameters.

    Their parameters join the model's, so that ``--set`` and expressions can use their names.  Their aspects come after
    the model's own, but an aspect with the name of another replaces it.
    """
    settings: list[Setting] = []
    for disturbance in disturbances:
        parameters = joined(text.root.parameters, disturbance.text.parameters, PARAMETER_THERE, problems)
        text = replace(text, root=replace(text.root, parameters=parameters))
        for part in disturbance.text.aspects.values():
            text = put_aspect(text, part)
        settings += disturbance.settings
        if disturbance.exactly is not None:
            text = replace(text, exactly=(*(text.exactly or ()), *disturbance.exactly))
    return text, settings


def only_acts(text: ModelText, settings: list[Setting], problems: Problems) -> tuple[ModelText, list[Setting]]:
    """A model of whose acts the setting ``exactly`` lets only some happen, and the other settings.

    A model's own parameter with that name comes first.
    """
    found = [] if EXACTLY in text.root.parameters else [each for each in settings if each.path == EXACTLY]
    if found:
        text = replace(text, exactly=acts(NodeReader(problems), found[-1].node, EXACTLY))
        settings = [each for each in settings if each.path != EXACTLY]
    return text, settings


def joined(known: dict[str, T], more: dict[str, T], message: str, problems: Problems) -> dict[str, T]:
    """What two files declare; if both declare a name, the first counts and the second is a problem."""
    for name, second in more.items():
        if (first := known.get(name)) is not None:
            hint = f"it is declared at {first.position.file}:{first.position.line}; give this one another name"
            problems.add(message.format(name), second.position, hint)
    return {**known, **more, **known}
