"""What actors, aspects and the other parts of a model declare, as plain data: ports, parameters, events, docs."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from inspect import cleandoc
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np

from epicycle.actors import (
    Actor,
    Configurable,
    Parameter,
    declared_parameters,
    declared_ports,
    has_own_ports,
    type_name,
    variants,
)
from epicycle.actors.expression import Formula, PortFormula, TokenFormula
from epicycle.aspects import Aspect


@dataclass(frozen=True, kw_only=True)
class PortReference:
    """A port of an actor type; ``depends_on`` is for outputs; None means all inputs."""

    name: str
    direction: str
    type: str
    multi: bool
    required: bool = False
    depends_on: tuple[str, ...] | None = None
    doc: str
    triggers: bool = True  # of an input: whether a token there triggers the actor


@dataclass(frozen=True, kw_only=True)
class ParameterReference:
    """A parameter of a type; ``type`` is in words, ``default`` as it would be written in a model file.

    ``part`` is the base of the types that its value may have, if it is a mapping with a type.
    """

    name: str
    type: str
    part: str
    unit: str
    required: bool
    optional: bool
    default: object
    min: float | None
    above: float | None
    max: float | None
    choices: tuple[str, ...]
    doc: str


R = TypeVar("R", PortReference, ParameterReference)


@dataclass(frozen=True)
class TypeReference:
    """A type that a model may name, and everything it declares.

    ``has_own_ports``: an instance has further ports, which follow from its parameters.
    """

    name: str
    kind: str
    group: str
    about_group: str
    doc: str
    ports: tuple[PortReference, ...]
    parameters: tuple[ParameterReference, ...]
    has_own_ports: bool
    stands_at: tuple[str, ...]
    events: tuple[str, ...]
    alters_parameters: bool
    reports: dict[str, str]  # figures at the end of a run, and their units

    @property
    def summary(self) -> str:
        return first_sentence(self.doc)


def describe(name: str, cls: type[Configurable]) -> TypeReference:
    """What a type declares."""
    group, about = _group(cls)
    return TypeReference(
        name=name,
        kind="actor" if issubclass(cls, Actor) else "aspect" if issubclass(cls, Aspect) else "part",
        group=group,
        about_group=about,
        doc=doc_of(cls),
        ports=tuple(
            _taken(PortReference, port, type=type_name(port.type))
            for port in (declared_ports(cls).values() if issubclass(cls, Actor) else ())
        ),
        parameters=tuple(
            _taken(
                ParameterReference,
                each,
                type=each.describe_type(),
                part=each.type.__name__ if is_part(each) else "",
                unit=each.unit if each.unit != "1" else "",
                default=None if each.required else as_written(each.default),
            )
            for each in declared_parameters(cls).values()
        ),
        has_own_ports=issubclass(cls, Actor) and has_own_ports(cls),
        stands_at=tuple(sorted(cls.stands_at)) if issubclass(cls, Aspect) else (),
        events=tuple(cls.events) if issubclass(cls, Aspect) else (),
        alters_parameters=issubclass(cls, Aspect) and cls.alters_parameters,
        reports=dict(cls.reports) if issubclass(cls, Aspect) else {},
    )


def _taken(reference: type[R], declared: object, **others: Any) -> R:
    """A reference with the attributes of what is declared, and others that are said in another way."""
    names = (each.name for each in fields(reference) if each.name not in others and hasattr(declared, each.name))
    return reference(**{name: getattr(declared, name) for name in names}, **others)


def parts_of(types: Iterable[type[Configurable]]) -> dict[type[Configurable], dict[str, type[Configurable]]]:
    """The bases whose variants are values of parameters (of these types, or of such variants), and their variants."""
    found: dict[type[Configurable], dict[str, type[Configurable]]] = {}
    waiting = list(types)
    while waiting:
        for parameter in declared_parameters(waiting.pop(0)).values():
            for form in (parameter, *parameter.forms):
                if is_part(form) and form.type not in found:
                    found[form.type] = dict(sorted(variants(form.type).items()))
                    waiting += found[form.type].values()
    return found


def is_part(parameter: Parameter[object]) -> bool:
    """Whether the parameter's value is a mapping with a type of its own."""
    return isinstance(parameter.type, type) and issubclass(parameter.type, Configurable)


def as_written(value: object) -> object:
    """A default as it would be written in a model file."""
    if isinstance(value, Configurable):
        declared = declared_parameters(type(value))
        given = {name: getattr(value, name) for name in declared}
        changed = {n: as_written(v) for n, v in given.items() if as_written(v) != as_written(declared[n].default)}
        return {"type": type(value).__name__, **changed}
    if isinstance(value, np.ndarray):
        return as_written(value.tolist())
    if isinstance(value, (list, tuple)):
        return [as_written(each) for each in value]
    if isinstance(value, Mapping):
        return {str(key): as_written(each) for key, each in value.items()}
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"  # JSON has no such numbers
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return int(value)
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, (Formula, PortFormula, TokenFormula)):
        return value.source
    return str(value) if isinstance(value, Path) else f"<{type(value).__name__}>"  # no file can say it


def shown(value: object) -> str:
    """A value of ``as_written`` on one line of YAML."""
    if value is None:
        return "none"
    if isinstance(value, str):
        return value or '""'
    if isinstance(value, list):
        return f"[{', '.join(map(shown, value))}]"
    if isinstance(value, dict):
        return f"{{{', '.join(f'{key}: {shown(each)}' for key, each in value.items())}}}"
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.6g}" if isinstance(value, float) else str(value)


# Topics in the order in which they are listed, and the modules of actors and aspects that belong to them.
TOPICS: Final[dict[str, tuple[str, tuple[str, ...]]]] = {
    "sources": ("Where tokens come from", ("sources", "triggered", "replay")),
    "computing": (
        "Arithmetic, logic, expressions, sums, statistics",
        ("accumulation", "arithmetic", "blocks", "functions", "logic", "statistics", "texts"),
    ),
    "flow": ("Routing, merging, filtering and storing tokens", ("flow", "passing", "variables")),
    "time": ("Delays and timers", ("timing",)),
    "queues and resources": ("Queues, servers and resources with units", ("queues", "resources")),
    "entities": ("Tokens with fields, and lists of tokens", ("entities",)),
    "networks": ("Links, switches, repeats", ("links",)),
    "modes": ("State machines", ("modes",)),
    "control": ("Continuous state, linear systems, filters, controllers, limits", ("continuous", "control")),
    "vehicles": ("Ground vehicles, their sensors and guidance", ("vehicles",)),
    "robotics": ("Robots that observe and avoid a moving obstacle, as in the paper", ("robotics",)),
    "sinks": ("Where tokens end", ("sinks",)),
    "communication": ("At input ports: whether, when and how a message arrives", ("communication", "trace", "media")),
    "measurement": ("At output ports: what a sensor seems to have measured", ("measurement",)),
    "situation": ("What depends on where bodies are: distance, range, line of sight, partition", ("situation",)),
    "execution": ("At actors: firings that take time or do not happen, crashes, clocks", ("clock", "execution")),
    "observation": ("At any port: observers that change nothing", ("observation",)),
    "figures": ("What draws runs and studies", ("show",)),
}


def topic_order(reference: TypeReference) -> tuple[int, str, str]:
    """The place of a type in a list: by its topic, those of other packages last, then by its name."""
    order = list(TOPICS)
    place = order.index(reference.group) if reference.group in order else len(order)
    return place, reference.group, reference.name.casefold()


def doc_of(cls: type) -> str:
    """The docstring of the class itself: a line for each paragraph, code in single backquotes as in Markdown."""
    own = vars(cls).get("__doc__") or ""
    paragraphs = re.sub(r"``(.+?)``", r"`\1`", cleandoc(str(own)), flags=re.DOTALL).split("\n\n")
    # Lists and examples keep their lines.
    return "\n\n".join(
        each if re.search(r"^( |[-*>] )", each, re.MULTILINE) else " ".join(each.split()) for each in paragraphs
    )


def first_sentence(doc: str) -> str:
    """The first sentence of a doc, on one line."""
    paragraph = " ".join(doc.partition("\n\n")[0].split())
    return re.split(r"(?<=[.!?:]) (?=[A-Z`])", paragraph)[0].rstrip(".:")


def about(word: str, types: Mapping[str, type]) -> list[str]:
    """The types that have a word in their names or in what they do, sorted."""
    if not (word.isalpha() and 2 < len(word) < 40):
        return []
    within = re.compile(rf"\b{word}s?\b", re.IGNORECASE)
    words = {name: re.sub("([A-Z])", r" \1", name) for name in types}
    return sorted(name for name in types if within.search(f"{words[name]} {first_sentence(doc_of(types[name]))}"))


def _group(cls: type) -> tuple[str, str]:
    """The topic under which a type is listed, and its description; for a package's own types, its name and doc."""
    parts = cls.__module__.split(".")
    # epicycle.actors.robotics.world is about robotics; acme_robots.lidar of acme_robots, epicycle.more.lidar of more.
    is_ours = parts[:2] in (["epicycle", each] for each in ("actors", "aspects", "runner"))
    depth = 3 if is_ours else 2 if parts[0] == "epicycle" else 1
    own = parts[depth - 1] if len(parts) >= depth else parts[-1]
    for topic, (about, modules) in TOPICS.items() if depth == 3 else ():
        if own in modules:
            return topic, about
    module = sys.modules.get(".".join(parts[:depth]))
    return own, first_sentence(getattr(module, "__doc__", "") or "")
