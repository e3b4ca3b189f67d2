"""What parts take from around them, and what a parameter takes from the part that it stands for.

A part with ``inherit`` gets the values of parameters with the same names of the composite, or model, that it is in. The
other way round, what a composite does not say of a parameter (unit, bounds, choices, doc, default) comes from the
parameter of the first part that takes its value unchanged.  A part whose type a parameter chooses gets one part for
each choice.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from graphlib import CycleError, TopologicalSorter
from typing import Any, TypeAlias

from epicycle.actors import (
    Configurable,
    FaultError,
    MappingParameter,
    Parameter,
    declared_parameters,
    found_variants,
)

from ..catalogue.reference import as_written, is_part
from ..catalogue.types import Catalogue, CatalogueError, figure_types
from ..text.document import Entry, Node, Scalar, plain
from ..text.document import Mapping as MappingNode
from ..text.kinds import TAKEN, UNIT
from ..text.problems import POISON, Poison, Position, Problems
from ..text.program import node_of
from ..text.reading import NodeReader, Text
from .models import CompositeText, ModelText
from .parts import PartText
from .ports import BOUNDS, ParameterText
from .usage import ALL, used_names

_ALONE = re.compile(r"\$\{\s*([A-Za-z_][A-Za-z0-9_]*)\s*\}")  # a value that is a parameter, unchanged
_LOWER = ("min", "above")
MAX_CHOICES = 100_000  # of the types of all parts together: each is a part to be checked

Known: TypeAlias = ParameterText | Parameter[Any]
Takers: TypeAlias = dict[str, list[tuple[str, Known]]]  # by name, who takes a value unchanged: as Type.name


@dataclass(frozen=True)
class _Asked:
    """What takes values: a part, or the value of a parameter that has a type."""

    name: str
    kind: str
    known: Mapping[str, Known]
    inherit: tuple[Text, ...]
    unused: tuple[str, ...] = ()


class Surroundings:
    """Settles what parts and parameters take from each other, from the inner composites to the outer ones."""

    def __init__(
        self, composites: Mapping[str, CompositeText | Poison], catalogue: Catalogue, problems: Problems
    ) -> None:
        self.composites = dict(composites)
        self.problems = problems
        self._catalogue = catalogue
        self._classes: dict[tuple[str, str], type | None] = {}  # by the key of a model, and the name
        self._chosen = 0  # types that parts may have, so far
        for name in _inner_first(self.composites):
            if composite := self.composites[name]:
                self.composites[name] = self.composite(composite)

    def model(self, text: ModelText) -> ModelText:
        """A model with what its parts, figures and parameters take."""
        root, taken = self.composite(text.root), list[Node]()
        figures = {
            name: self._part(root, part, "figures", taken) if part.inherit else part
            for name, part in text.figures.items()
        }
        return replace(text, root=replace(root, written=(*root.written, *taken)), figures=figures)

    def composite(self, text: CompositeText) -> CompositeText:
        """A composite with what its parts and parameters take."""
        taken, takers = list[Node](), Takers()
        parts: dict[str, Any] = {
            key: {name: self._part(text, part, key, taken) for name, part in getattr(text, key).items()}
            for key in ("actors", "refinements", "aspects")
        }
        for key, found in {"machine": {"": text.machine} if text.machine else {}, **parts}.items():
            for part in found.values():
                for each in part.choices.values() or (part,):
                    self._add_takers(each.type.text, self._known(key, each.type.text) or {}, each.values, takers)
        text = replace(text, **parts, written=(*text.written, *taken))
        return replace(text, parameters={k: self._parameter(text, p, takers) for k, p in text.parameters.items()})

    # -- what parts take ----------------------------------------------------------------------------------------------

    def _part(self, owner: CompositeText, part: PartText, key: str, taken: list[Node]) -> PartText:
        """A part with the values that it takes, also added to ``taken``; or with each type that it may have."""
        if "${" in part.type.text and key in ("actors", "refinements"):
            types = {} if part.choices else self._choices(owner, part, key)
            self._chosen += len(types)
            if self._chosen > MAX_CHOICES:
                message = f"{owner.name}: the types that parts may have are more than {MAX_CHOICES:,} together"
                self.problems.stop(message, part.type.position)
            choices = {name: self._part(owner, replace(part, type=each), key, taken) for name, each in types.items()}
            return replace(part, choices=part.choices or choices)
        known = self._known(key, part.type.text)
        if known is None:
            return part  # there is no such type, or which one it is depends on a director
        for name in sorted(part.kept - known.keys()):
            message = f"{owner.name}: {part.name} is a {part.type.text}, which has no parameter {name!r}"
            hint = f"the base gives it {name!r}: remove {part.name} by 'null', and add the new one under another name"
            self.problems.add(message, part.type.position, hint)
        given = {name: entry for name, entry in part.values.items() if name in known or name not in part.kept}
        unused = getattr(self._class(key, part.type.text), "unused", ())
        asked = _Asked(part.name, part.type.text, known, part.inherit, unused)
        values = self._values(owner, asked, given, taken)
        if values == part.values and not part.inherit and not part.kept:
            return part
        return replace(part, values=values, inherit=(), kept=frozenset())

    def _values(
        self, owner: CompositeText, asked: _Asked, given: Mapping[str, Entry], taken: list[Node]
    ) -> dict[str, Entry]:
        """The values of a part, with those that it takes."""
        values = dict(given)
        for name, at in self._names(owner, asked):
            if name not in values:
                text = f"${{{name}}}"
                node = Scalar(text, text, True, at, f"{owner.name}.{name}")
                values[name] = Entry(Scalar(name, name, True, at), node)
                taken.append(node)
        for name in [name for name in values if name in asked.known]:
            if isinstance(mapping := values[name].value, MappingNode):
                inner = self._value(owner, f"{asked.name}.{name}", asked.known[name], mapping, taken)
                values[name] = replace(values[name], value=inner)
        return values

    def _value(self, owner: CompositeText, name: str, known: Known, node: Node, taken: list[Node]) -> Node:
        """The value of a parameter; one that has a type may take values, too."""
        if not isinstance(node, MappingNode):
            return node
        entries = dict(node.entries)
        if (item := _item(known)) is not None:
            inside = {
                key: self._value(owner, f"{name}.{key}", item, each.value, taken) for key, each in entries.items()
            }
            return replace(node, entries={key: replace(entries[key], value=each) for key, each in inside.items()})
        cls, said = _variant(known, node), entries.pop("inherit", None)
        if cls is None:
            return node
        inherit: tuple[Text, ...] = ()
        if said is not None:
            inherit = NodeReader(self.problems).texts(said.value, f"{owner.name}: 'inherit' of {name}") or ()
        kind = entries.pop("type")
        asked = _Asked(name, cls.__name__, declared_parameters(cls), inherit)
        return replace(node, entries={"type": kind, **self._values(owner, asked, entries, taken)})

    def _names(self, owner: CompositeText, asked: _Asked) -> Iterator[tuple[str, Position]]:
        """The parameters of a part that take a value from around it, and where that is said."""
        for text in asked.inherit:
            if text.text == ALL:
                valid = asked.known.keys() - asked.unused
                yield from ((name, text.position) for name in owner.parameters if name in valid)
                continue
            for who, names in ((asked.kind, asked.known), (owner.name, owner.parameters)):
                if text.text not in names:
                    message = f"{owner.name}: {asked.name} inherits {text.text!r}, but {who} has no such parameter"
                    hint = f"parameters of {who}: {', '.join(names) or 'none'}"
                    near = text.text, names
                    self.problems.add(message, text.position, hint, kind=TAKEN, near=near)
                    break
            else:
                yield text.text, text.position

    def _choices(self, owner: CompositeText, part: PartText, key: str) -> Mapping[str, Text]:
        """The types that a part may have, by the values of the parameter that chooses one."""
        chooser = _ALONE.fullmatch(part.type.text)
        if chooser is None or key != "actors":
            message = f"{owner.name}: the type of {part.name} cannot be computed"
            hint = "a parameter may choose that of an actor: 'type: ${name}'"
            self.problems.add(message, part.type.position, hint, kind=TAKEN)
            return {}
        name = chooser[1]
        message, declared = f"{owner.name}: {name!r} chooses the type of {part.name}, but ", owner.parameters.get(name)
        if declared is None:
            hint = f"parameters of {owner.name}: {', '.join(owner.parameters) or 'none'}"
            message += f"{owner.name} has no such parameter"
            self.problems.add(message, part.type.position, hint, kind=TAKEN, near=(name, owner.parameters))
        elif not declared.choices and declared.value is not POISON:
            hint = f"write '{name}: {{choices: [FirstType, SecondType]}}', or 'choices: {{first: FirstType, ...}}'"
            self.problems.add(f"{message}it has no choices", declared.position, hint, kind=TAKEN)
        return {} if declared is None else declared.choices

    def _known(self, key: str, kind: str) -> Mapping[str, Known] | None:
        """The parameters of a type under one of the keys of a model; None if it is not known."""
        if (inner := self.composites.get(kind)) is not None and key != "figures":
            return inner.parameters if inner else None
        cls = self._class(key, kind)
        return None if cls is None else declared_parameters(cls)

    def _class(self, key: str, kind: str) -> type | None:
        """The class of an actor, aspect or figure type; None if it is not known."""
        if (key, kind) not in self._classes:
            types: Mapping[str, type[Configurable]] = self._catalogue.actors
            if key in ("aspects", "figures"):
                types = self._catalogue.aspects if key == "aspects" else figure_types()
            try:
                self._classes[key, kind] = types.get(kind)
            except CatalogueError:
                self._classes[key, kind] = None
        return self._classes[key, kind]

    # -- what parameters take -----------------------------------------------------------------------------------------

    def _add_takers(self, kind: str, known: Mapping[str, Known], values: Mapping[str, Entry], takers: Takers) -> None:
        """Add the parameters of a part that take a value unchanged."""
        for name, entry in values.items():
            if name not in known:
                continue
            node = entry.value
            if isinstance(node, Scalar):
                if isinstance(node.value, str) and (found := _ALONE.fullmatch(node.value)) is not None:
                    takers.setdefault(found[1], []).append((f"{kind}.{name}", known[name]))
                continue
            item = _item(known[name])
            whole = item or known[name]
            for each in [node] if item is None else [each.value for each in getattr(node, "entries", {}).values()]:
                if isinstance(each, MappingNode) and (cls := _variant(whole, each)) is not None:
                    inner = {key: part.in_unit(whole.unit) for key, part in declared_parameters(cls).items()}
                    self._add_takers(cls.__name__, inner, each.entries, takers)

    def _parameter(self, owner: CompositeText, parameter: ParameterText, takers: Takers) -> ParameterText:
        """A parameter with what is not said of it, by the parts that take it."""
        found = takers.get(parameter.name)
        if not found or parameter.source or parameter.value is POISON:
            return parameter
        label, first = found[0]
        if "unit" in parameter.given and parameter.unit != first.unit:  # it is something else that fits
            return parameter if "doc" in parameter.given else replace(parameter, doc=first.doc)
        about = _about(first, parameter.position)
        given = {*parameter.given, *(_LOWER if set(_LOWER) & set(parameter.given) else ())}
        said = {key: each for key, each in about.items() if key not in given}
        units = {each.unit: name for name, each in reversed(found) if "unit" in _about(each, parameter.position)}
        units.pop("", None)
        if "unit" in said and len(units) > 1:
            told = " and ".join(f"{name} in {unit}" for unit, name in sorted(units.items()))
            message = f"{owner.name}: parameter {parameter.name!r} has no unit of its own, and is taken by {told}"
            self.problems.add(message, parameter.position, f"write '{parameter.name}: {{unit: ...}}'", kind=UNIT)
            said["value"] = POISON
        elif "value" not in parameter.given:
            said |= _default(found, parameter.position)
        inner = isinstance(first, ParameterText) and first.source
        return replace(parameter, **said, of=_parameter_of(first), source=inner or label)


def _inner_first(composites: Mapping[str, CompositeText | Poison]) -> list[str]:
    """The classes, each after those of its parts; in the order of the files if one contains itself."""
    inside: dict[str, list[str]] = {}
    for name, text in composites.items():
        kinds: list[str] = []
        if text:
            parts = (*text.actors.values(), *text.aspects.values(), *text.refinements.values())
            kinds += (part.type.text for part in parts)
            kinds += (each.text for parameter in text.parameters.values() for each in parameter.choices.values())
        inside[name] = [kind for kind in dict.fromkeys(kinds) if kind in composites]
    try:
        return [*TopologicalSorter(inside).static_order()]
    except CycleError:
        return list(composites)


def _parameter_of(known: Known) -> Parameter[Any] | None:
    """The parameter of an actor or aspect that is meant in the end."""
    return known.of if isinstance(known, ParameterText) else known


def _item(known: Known) -> Parameter[Any] | None:
    """What a mapping of names holds for each."""
    parameter = _parameter_of(known)
    return parameter.item if isinstance(parameter, MappingParameter) else None


def _variant(known: Known, node: MappingNode) -> type | None:
    """The class of a value that has a type, such as ``{type: ReachGoal, ...}``."""
    parameter, kind = _parameter_of(known), node.entries.get("type")
    if parameter is None or kind is None or not isinstance(kind.value, Scalar) or "${" in kind.value.text:
        return None
    for form in filter(is_part, (parameter, *parameter.forms)):
        try:
            if (found := found_variants(form.type, kind.value.value).get(kind.value.text)) is not None:
                return found
        except FaultError:
            return None  # which is reported when the value is made
    return None


def _about(known: Known, position: Position) -> dict[str, Any]:
    """What a declaration says besides the default."""
    if isinstance(known, ParameterText):
        return {key: getattr(known, key) for key in ("unit", *BOUNDS, "choices", "doc")}
    found: dict[str, Any] = {"doc": known.doc}
    if not known.forms and known.type in (float, int, int | float):
        found |= {key: getattr(known, key) for key in ("unit", *BOUNDS)}
    elif not known.forms and known.choices:
        found["choices"] = {each: Text(each, position) for each in known.choices}
    return found


def _default(takers: list[tuple[str, Known]], position: Position) -> dict[str, Any]:
    """The default that all who take a value have; without one, or with different ones, a value must be given."""
    nodes = {label: _default_of(known, position) for label, known in takers}
    told = {label: plain(node) for label, node in nodes.items() if node}
    if len(told) < len(nodes):
        return {"value": None}
    first, *others = told.values()
    if all(each == first for each in others):
        return {"value": next(iter(nodes.values()))}
    different = ", ".join(f"{label} has {each}" for label, each in told.items())
    return {"value": None, "undecided": f"those that take it have different defaults: {different}"}


def _default_of(known: Known, position: Position) -> Node | Poison | None:
    """The default as a file would say it; None if there is none that could stand elsewhere."""
    if isinstance(known, ParameterText):
        return None if known.value and used_names([known.value]) else known.value
    if known.required:
        return None
    default: Any = known.default
    return node_of(as_written(default) if isinstance(default, Configurable) else default, position)
