"""What is changed of a model from outside: ``--disturb name``, ``--aspect name=Type,...``, ``--without name``."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import TypeVar

from epicycle.actors import did_you_mean

from ..catalogue.packaged import find
from ..text.document import Entry, Mapping, Scalar, read
from ..text.kinds import FILE
from ..text.problems import POISON, Poison, Problems
from ..text.reading import NAME, NAMES_HAVE, NodeReader, Text, split
from .models import CompositeText, ModelText, disturbance_of
from .parts import PartText, beside
from .places import PointcutText
from .ports import ParameterText
from .settings import Setting, acts, in_option, value_in
from .usage import check_own_usage

EXACTLY = "exactly"
T = TypeVar("T", CompositeText, ParameterText)
PARAMETER_THERE, COMPOSITE_THERE = "the model already has a parameter {!r}", "there is already a composite {!r}"


def load_disturbance(name: str, problems: Problems) -> ModelText | Poison:
    """A disturbance by its name or path; poison if it cannot be read at all."""
    path = find(name, "disturbance", problems)
    node = None if path is None else read(path, problems)
    if node is None:
        return POISON
    if isinstance(node, Mapping) and "model" in node.entries and "disturbance" not in node.entries:
        hint = "a disturbance begins with a line like 'disturbance: my_disturbance'"
        message, at = f"{node.position.file} is a model, not a disturbance", node.entries["model"].key.position
        return problems.add(message, at, hint, kind=FILE)
    text = disturbance_of(node, problems)
    if text:
        check_own_usage(text.root, problems)
    return text


def load_disturbances(names: Iterable[str], problems: Problems) -> list[ModelText]:
    """Disturbances by their names or paths."""
    found: dict[str, ModelText | Poison] = {}
    for name in names:
        if name in found:
            problems.add(f"the disturbance {name} is given twice", None, "leave one of them out")
        else:
            found[name] = load_disturbance(name, problems)
    return [disturbance for disturbance in found.values() if disturbance]


def add_disturbances(
    text: ModelText, disturbances: Iterable[ModelText], problems: Problems
) -> tuple[ModelText, list[Setting]]:
    """A model with the contents of disturbances, and the values that they set for the model's parameters.

    Their parameters join the model's, so that ``--set`` and expressions can use their names.  Their aspects come after
    the model's own, but an aspect with the name of another replaces it.
    """
    settings: list[Setting] = []
    for disturbance in disturbances:
        parameters = joined(text.root.parameters, disturbance.root.parameters, PARAMETER_THERE, problems)
        text = replace(text, root=replace(text.root, parameters=parameters))
        for part in disturbance.root.aspects.values():
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


def without(text: ModelText, name: str, problems: Problems) -> ModelText:
    aspects = text.root.aspects
    if name not in aspects:
        message = f"the model has no aspect {name!r}{did_you_mean(name, list(aspects))}"
        problems.add(message, in_option(f"--without {name}", 10), f"its aspects: {', '.join(aspects) or 'none'}")
    left = {key: part for key, part in aspects.items() if key != name}
    return replace(text, root=replace(text.root, aspects=left))


def change_aspect(text: ModelText, change: str, problems: Problems) -> ModelText:
    """``name=Type,key=value,...``: the model with a new aspect, or with an existing one replaced.

    ``put_aspect`` documents what a replaced aspect leaves to the new one.
    """
    option = f"--aspect {change}"
    position = in_option(option, 9)
    name, equals, rest = change.partition("=")
    places = split(rest, ",")
    parts = [rest[start:end].strip() for start, end in places]
    if not equals or not name.strip() or not parts or not parts[0]:
        problems.add(f"{change!r} is not of the form name=Type,key=value", position)
        return text
    name = name.strip()
    values: dict[str, Entry] = {}
    at: tuple[PointcutText, ...] | None = None
    for part, (_, end) in zip(parts[1:], places[1:], strict=True):
        key, equals, value = part.partition("=")
        key = key.strip()
        if not equals or not key:
            problems.add(f"{part!r} is not of the form key=value", position)
            return text
        stop = len(option) - len(rest) + end
        if key in values or (key == "at" and at is not None):
            problems.add(f"{key!r} is given twice", in_option(option, stop - len(part), len(part)))
            return text
        if key == "at":
            at = _pointcuts(value, option, stop - len(value))
            continue
        node = value_in(value, option, stop - len(value), problems)
        if node is None:
            return text
        values[key] = Entry(Scalar(key, key, True, position), node)
    if not NAME.match(name):
        problems.add(f"{name!r} is not a name", position, NAMES_HAVE)
        return text
    enabled = beside("enabled", values.pop("enabled").value) if "enabled" in values else None
    added = PartText(name, position, Text(parts[0], position), values, at=at or (), enabled=enabled)
    return put_aspect(text, added)


def put_aspect(text: ModelText, part: PartText) -> ModelText:
    """The model with a new aspect, which replaces the one with its name.

    The replaced aspect leaves its ports unless the new one has its own, and its parameters if the type stays the same.
    """
    old = text.root.aspects.get(part.name)
    if old is not None:
        values = {**old.values, **part.values} if old.type.text == part.type.text else part.values
        part = replace(part, at=part.at or old.at, values=values)
    return replace(text, root=replace(text.root, aspects={**text.root.aspects, part.name: part}))


def _pointcuts(value: str, option: str, offset: int) -> tuple[PointcutText, ...]:
    """``port`` or ``[port, port]``, read without YAML, where ``[observer[*].plan]`` is a broken list."""
    if value.startswith("[") and value.endswith("]"):
        value, offset = value[1:-1], offset + 1
    found = []
    for start, end in split(value, ","):
        text = value[start:end].strip(" '\"")
        at = offset + start + value[start:end].find(text)
        found.append(PointcutText.of(Text(text, in_option(option, at, len(text)))))
    return tuple(found)
