"""From declarations to a checked model: parameters resolved, composites unfolded, actors made, ports wired.

What is wrong is noted and worked around, so that one load tells it all: a wrong value becomes ``missing`` and what is
computed from it is not judged; an actor that cannot be made leaves its ports in the graph, for others to connect to.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

from epicycle.actors import (
    Actor,
    EpicycleError,
    Parameter,
    ParameterError,
    counted_in_si,
    declared_parameters,
    plain,
    to_nanoseconds,
    unknown_parameter,
)

from .catalogue import Catalogue, CatalogueError
from .checks import check
from .declarations import CompositeText, ModelText, PartText, PortText
from .document import Entry, Mapping, Node
from .files import data_file
from .graph import ModelGraph
from .model import Model
from .observation import Observation
from .patterns import PathIndex
from .port_types import PortTypeError, read_type, token_types
from .problems import Position, Problems, did_you_mean, nearest
from .settings import Setting, Settings
from .values import Values
from .weave import Weaving, WovenAspect
from .wiring import Child, Wiring

_INDEX = re.compile(r"\[\d+\]")
MAX_COUNT = 100_000
MAX_INSTANCES = 200_000  # of actors and composites together
MAX_DEPTH = 50
MAX_SHOWN = 12  # types in one message


class TooLargeError(Exception):
    """The model has too many parts to go on; the reason has been noted."""


class Elaborator:
    """Unfolds one model; problems are collected, and the model is good only if there are none."""

    def __init__(
        self,
        text: ModelText,
        composites: dict[str, CompositeText],
        settings: Settings,
        problems: Problems,
        catalogue: Catalogue,
        broken: Collection[str] = (),
    ) -> None:
        self.text = text
        self.composites = composites
        self.broken = broken  # composites that are there, but lack what they extend
        self.settings = settings
        self.problems = problems
        self.catalogue = catalogue
        self.graph = ModelGraph()
        self.values = Values(problems)
        self.settable: dict[str, None] = {}
        self.aspects: list[WovenAspect] = []
        # Aspects are woven when all ports exist: (name, scope, declaration, names).
        self._to_weave: list[tuple[str, str, PartText, dict[str, object]]] = []
        self.made: set[str] = set()  # the composite classes of which there are instances
        self._instances = 0
        self._port_types: dict[str, Any] = {}
        self._token_types: dict[str, type] | None = None

    def model(self) -> Model:
        """The whole model."""
        root = self.text.root
        for name in sorted(self.composites.keys() & self.catalogue.actors.keys()):
            self.problems.add(
                f"composite {name!r} has the name of an actor type",
                self.composites[name].position,
                "give it another name",
            )
        self.values.of_model = root.parameters
        names = self._parameters("", root, {}, {}, None)
        try:
            self._body("", root, names, ())
        except TooLargeError:
            return Model(root.name)
        ports = PathIndex(self.graph.ports.nodes)
        for name, scope, part, scope_names in self._to_weave:
            self._aspect(name, scope, part, scope_names, ports)
        for setting in self.settings.unused():
            self._add_unused(setting)
        check(self.graph, self.problems)
        model = Model(root.name, doc=root.doc)
        model.graph, model.aspects = self.graph, self.aspects
        model.warnings = self.problems.warnings
        model.parameters = {name: _shown(value, root.parameters[name].unit) for name, value in names.items()}
        Observation(model, self.values, self.problems).read(self.text, names)
        for name, part in self.text.figures.items():
            values = {
                key: counted_in_si(self.values.of(entry.value, names, f"figure {name}.{key}"))
                for key, entry in part.values.items()
            }
            model.figures[name] = (part.type.text, values, part.type.position)
        return model

    def woven(self, graph: ModelGraph) -> list[WovenAspect]:
        """The aspects that the text declares, woven around a graph that is there."""
        self.graph = graph
        names = self._parameters("", self.text.root, {}, {}, None)
        ports = PathIndex(graph.ports.nodes)
        for name, part in self.text.root.aspects.items():
            self._aspect(name, "", part, names, ports)
        for setting in self.settings.unused():
            self._add_unused(setting)
        return self.aspects

    def instance(self, path: str, part: PartText) -> list[WovenAspect]:
        """Unfold one instance of a composite class into the graph; the aspects that come with it."""
        _, bracket, index = path.rpartition("[")
        names: dict[str, object] = {"index": int(index.rstrip("]"))} if bracket and path.endswith("]") else {}
        try:
            self._actor(path, path.rpartition(".")[0], part, names, ())
        except TooLargeError:
            return []
        ports = PathIndex(self.graph.ports.nodes)
        for name, scope, aspect, scope_names in self._to_weave:
            self._aspect(name, scope, aspect, scope_names, ports)
        return self.aspects

    def _add_unused(self, setting: Setting) -> None:
        """A setting that no parameter took, unless it is meant for an array that is empty now."""
        if self.graph.is_excused(setting.path):
            return
        known = list(self.settable)
        if "[*]" in setting.path:
            known = list(dict.fromkeys(_INDEX.sub("[*]", path) for path in known))
        owner, _, last = setting.path.rpartition(".")
        beside = [path.rpartition(".")[2] for path in known if path.rpartition(".")[0] == owner]
        # The nearest one of the same owner, or else the nearest of all.
        near = did_you_mean(last, beside).replace("mean '", f"mean '{owner}." if owner else "mean '")
        near = near or did_you_mean(setting.path, known)
        valid = (f"valid parameters {f'of {owner}' if owner else 'here'}: {', '.join(beside)}",) if beside else ()
        self.problems.add(f"{setting.path!r} sets no parameter{near}", setting.position, *(() if near else valid))

    # -- parameters -----------------------------------------------------------------------------------------------

    def _parameters(
        self,
        path: str,
        composite: CompositeText,
        given: dict[str, Entry],
        outer: dict[str, object],
        position: Position | None,
    ) -> dict[str, object]:
        """The values of a composite's parameters: set from outside, else given, else the default."""
        names: dict[str, object] = {}
        label = path or composite.name
        above = path.rpartition(".")[0]  # the composite whose fault a wrong value is
        for key, entry in given.items():
            if key not in composite.parameters:
                self.problems.add(
                    f"{label}: {composite.name} has no parameter {key!r}"
                    f"{did_you_mean(key, list(composite.parameters))}",
                    entry.key.position,
                    f"valid parameters: {', '.join(composite.parameters) or 'none'}",
                    scope=above,
                )
        given = _as_meant(given, composite.parameters)
        for name, declared in composite.parameters.items():
            full = f"{path}.{name}" if path else name
            node, scope, instance = declared.value, names, path
            later: Sequence[str] = list(composite.parameters)
            if name in given:
                node, scope, instance, later = given[name].value, outer, above, ()
            if (setting := self._setting(full)) is not None:
                node, scope, instance, later = setting.node, {}, "", ()
            if node is None:
                needs = f"{label}: {composite.name} needs" if path else f"{label} needs"
                self.problems.add(
                    f"{needs} a value for {name!r}",
                    position or declared.position,
                    *((f"{name}: {declared.doc}",) if declared.doc else ()),
                    scope=above,
                )
                names[name] = self.values.missing
                continue
            value = self.values.of(node, scope, full, instance, later)
            names[name] = self.values.declared(full, declared, value, node.position, instance)
        return names

    def _setting(self, full: str) -> Setting | None:
        """The setting for a parameter, if there is one."""
        self.settable[full] = None
        return self.settings.find(full)

    def _configuration(
        self,
        label: str,
        cls: type,
        given: dict[str, Entry],
        names: dict[str, object],
        position: Position,
        path: str,
        composite: str,
    ) -> dict[str, object] | None:
        """Converted values for a Configurable class; None if some are wrong."""
        declared = declared_parameters(cls)
        before, complete = len(self.problems), True
        result: dict[str, object] = {}
        for key, entry in given.items():
            if key not in declared:
                self.problems.add(
                    f"{label}: {unknown_parameter(cls, key)}",
                    entry.key.position,
                    f"valid parameters: {', '.join(declared) or 'none'}",
                    scope=composite,
                )
        given = _as_meant(given, declared)
        for name, parameter in declared.items():
            node = given[name].value if name in given else None
            scope = names
            if (setting := self._setting(f"{path}.{name}")) is not None:
                node, scope = setting.node, {}
            if node is None:
                if parameter.required:
                    self.problems.add(
                        f"{label}: {cls.__name__} needs a value for {name!r}",
                        position,
                        *((f"{name}: {parameter.doc}",) if parameter.doc else ()),
                        scope=composite,
                    )
                continue
            value = self.values.of(node, scope, f"{label}.{name}", composite)
            if value is self.values.missing:
                complete = False
                continue
            try:
                result[name] = parameter.convert(value)
                if parameter.type is Path and result[name] is not None:
                    result[name] = data_file(Path(value), node.position)
            except ParameterError as error:
                self.problems.add(f"{label}.{name}: {error}", _place(node, error), scope=composite)
        return result if complete and len(self.problems) == before else None

    def _valid_types(self, kind: str, asked: str) -> str:
        """Which types there are: their names, or how to see them if they are too many for a message."""
        is_actor = kind == "actor"
        types: Collection[str] = self.catalogue.actors if is_actor else self.catalogue.aspects
        others: Collection[str] = self.catalogue.aspects if is_actor else self.catalogue.actors
        if asked in others:
            other = "aspect" if is_actor else "actor"
            return f"{asked} is an {other}: it belongs under '{other}s'"
        composites = sorted(self.composites) if is_actor else []
        if len(composites) + len(types) <= MAX_SHOWN:
            return f"valid types: {', '.join(sorted([*composites, *types]))}"
        own = ", ".join(composites[:MAX_SHOWN]) + (", ..." if len(composites) > MAX_SHOWN else "")
        return f"valid types: {f'{own}, and ' if own else ''}those that 'epicycle {kind}s' lists"

    # -- the inside of a composite --------------------------------------------------------------------------------

    def _body(self, path: str, composite: CompositeText, names: dict[str, object], within: tuple[str, ...]) -> None:
        """Make a composite's actors and connect them."""
        children: dict[str, Child] = {}
        for name, part in composite.actors.items():
            full = f"{path}.{name}" if path else name
            child = self._actor(full, path, part, names, within)
            if child is None:
                self.graph.unknown.add(full)
            else:
                children[name] = child
        wiring = Wiring(path, composite, children, self.graph, self.values, self.problems)
        self.graph.is_wired = self.graph.is_wired and composite.is_wired
        for connection in composite.connections:
            wiring.connect(connection, names)
        for name, part in composite.aspects.items():
            self._to_weave.append((f"{path}.{name}" if path else name, path, part, names))

    def _actor(
        self,
        path: str,
        composite: str,
        part: PartText,
        names: dict[str, object],
        within: tuple[str, ...],
    ) -> Child | None:
        """Make the instances of one entry of ``actors``."""
        inner = self.composites.get(part.type.text)
        try:
            actor_type = self.catalogue.actors.get(part.type.text) if inner is None else None
        except CatalogueError as error:
            self.problems.add(f"{path}: {error.message}", part.type.position, *error.help, scope=composite)
            return None
        if part.type.text in self.broken:
            return None
        if inner is None and actor_type is None:
            known = [*self.composites, *self.catalogue.actors]
            self.problems.add(
                f"{path}: there is no actor type {part.type.text!r}{did_you_mean(part.type.text, known)}",
                part.type.position,
                self._valid_types("actor", part.type.text),
                scope=composite,
            )
            return None
        if inner is not None and inner.name in within:
            self.problems.add(
                f"{path}: composite {inner.name} contains itself: "
                f"{' -> '.join([*within[within.index(inner.name) :], inner.name])}",
                part.type.position,
                scope=composite,
            )
            return None
        if len(within) >= MAX_DEPTH:
            self.problems.add(f"{path}: composites are nested deeper than {MAX_DEPTH} levels", part.type.position)
            return None
        count = self._count(path, composite, part, names)
        child = Child([], part.count is not None, inner, actor_type, count)
        if count is None:
            self.graph.unknown.add(path)
        elif part.count is not None and count == 0:
            self.graph.empty_arrays.add(path)
            self.graph.absent |= self._kinds(part)
        before, was_muted = len(self.problems), self.problems.muted
        for index in range(count or 0):
            self._enlist(path, part)
            instance = f"{path}[{index}]" if part.count is not None else path
            scope = {**names, "index": index} if part.count is not None else names
            child.paths.append(instance)
            self._prioritise(instance, composite, inner, part, scope)
            if part.tags:
                self.graph.tags[instance] = tuple(tag.text for tag in part.tags)
            if inner is not None:
                self._composite(instance, inner, part, scope, within)
            elif actor_type is not None:
                actor = self._make(instance, composite, actor_type, part, scope)
                child.actors += [] if actor is None else [actor]
            if len(self.problems) > before:
                self.problems.muted = True  # the other instances would only repeat it
        self.problems.muted = was_muted
        return child

    def _enlist(self, path: str, part: PartText) -> None:
        """Count one more instance; raises ``TooLargeError`` if there are too many."""
        self._instances += 1
        if self._instances > MAX_INSTANCES:
            self.problems.muted = False
            self.problems.add(f"{path}: the model has more than {MAX_INSTANCES:,} actors and composites", part.position)
            raise TooLargeError

    def _kinds(self, part: PartText) -> set[str]:
        """The types and tags that an instance of this part and what is in it would have."""
        found: set[str] = set()
        waiting, seen = [part], set[str]()
        while waiting:
            each = waiting.pop()
            found |= {each.type.text, *(tag.text for tag in each.tags)}
            if (inner := self.composites.get(each.type.text)) is not None and inner.name not in seen:
                seen.add(inner.name)
                waiting += inner.actors.values()
        return found

    def _count(self, path: str, composite: str, part: PartText, names: dict[str, object]) -> int | None:
        """How many instances there are; None if that is not known."""
        if part.count is None:
            return 1
        value = self.values.of(part.count, names, f"{path}: count", composite)
        if value is self.values.missing:
            return None
        try:
            return Parameter(int, min=0, max=MAX_COUNT).convert(value)
        except ParameterError as error:
            self.problems.add(f"{path}: count: {error}", part.count.position, scope=composite)
            return None

    def _composite(
        self,
        path: str,
        composite: CompositeText,
        part: PartText,
        names: dict[str, object],
        within: tuple[str, ...],
    ) -> None:
        inside = self._parameters(path, composite, part.values, names, part.position)
        if "index" in names:
            inside.setdefault("index", names["index"])
        self._unfold(path, composite, inside, part.position, within)

    def _unfold(
        self,
        path: str,
        composite: CompositeText,
        inside: dict[str, object],
        position: Position | None,
        within: tuple[str, ...],
    ) -> None:
        """One instance of a composite, its ports and all that is in it; ``inside`` are its parameters."""
        self.made.add(composite.name)
        self.graph.composites[path] = composite.name
        for direction, ports in (("input", composite.inputs), ("output", composite.outputs)):
            for name, port in ports.items():
                self.graph.add_composite_port(
                    f"{path}.{name}", direction, position, self._port_type(composite, port), port.position
                )
        if composite.director is not None:
            start, drift = self._clock(path, composite.director, inside)
            self.graph.add_director(path, start, drift)
        self._body(path, composite, inside, (*within, composite.name))

    def _port_type(self, composite: CompositeText, port: PortText) -> Any:
        """The type that a composite declares for a port; None if it says none, or none that there is."""
        if port.type is None:
            return None
        text = port.type.text
        if text not in self._port_types:
            try:
                self._port_types[text] = read_type(text, self._tokens)
            except PortTypeError as error:
                self._port_types[text] = error
        found = self._port_types[text]
        if isinstance(found, PortTypeError):
            hints = (found.help,) if found.help else ()
            self.problems.add(f"port {port.name!r} of {composite.name}: {found.message}", port.type.position, *hints)
            return None
        return found

    def _tokens(self) -> dict[str, type]:
        if self._token_types is None:
            self._token_types = token_types(self.catalogue)
        return self._token_types

    def _clock(self, path: str, director: dict[str, Entry], names: dict[str, object]) -> tuple[int | None, float]:
        """When the local time of a composite starts (ns; None: as it is around it) and how fast it goes."""
        found: dict[str, Any] = {"start": None, "drift": 1.0}
        for key, entry in director.items():
            value = self.values.of(entry.value, names, f"{path}: director.{key}", path)
            if value is self.values.missing:
                continue
            try:
                if key == "start":
                    found[key] = to_nanoseconds(Parameter(float, unit="s").convert(value) or 0.0)
                else:
                    found[key] = Parameter(float, unit="1", min=1e-6, max=1e6).convert(value)
            except (ParameterError, ValueError) as error:
                self.problems.add(f"{path}: director.{key}: {error}", entry.value.position, scope=path)
        return found["start"], found["drift"]

    def _prioritise(
        self, path: str, composite: str, inner: CompositeText | None, part: PartText, names: dict[str, object]
    ) -> None:
        """Note the priority of an actor, or of a composite that fires as one."""
        if part.priority is None:
            return
        if inner is not None and inner.director is None:
            self.problems.add(
                f"{path}: {inner.name} has no priority, for its actors fire one by one",
                part.priority.position,
                f"give the actors inside a priority, or give {inner.name} a director of its own: 'director: {{}}'",
                scope=composite,
            )
            return
        value = self.values.of(part.priority, names, f"{path}: priority", composite)
        if value is self.values.missing:
            return
        try:
            self.graph.priorities[path] = Parameter(int).convert(value) or 0
        except ParameterError as error:
            self.problems.add(f"{path}: priority: {error}", part.priority.position, scope=composite)

    def _make(
        self, path: str, composite: str, actor_type: type[Actor], part: PartText, names: dict[str, object]
    ) -> Actor | None:
        values = self._configuration(path, actor_type, part.values, names, part.position, path, composite)
        if values is not None:
            try:
                actor = actor_type(path, **values)
                self.graph.add_actor(actor, part.position)
                return actor
            except (EpicycleError, ValueError) as error:  # what an actor's own __init__ has against it
                self.problems.add(f"{path}: {error}", part.position, scope=composite)
        self.graph.add_unmade(path, actor_type)
        return None

    # -- aspects ------------------------------------------------------------------------------------

    def _aspect(self, name: str, scope: str, part: PartText, names: dict[str, object], all_ports: PathIndex) -> None:
        known = self.catalogue.aspects
        try:
            cls = known.get(part.type.text)
        except CatalogueError as error:
            self.problems.add(f"aspect {name}: {error.message}", part.type.position, *error.help, scope=scope)
            return
        if cls is None:
            self.problems.add(
                f"aspect {name}: there is no aspect type {part.type.text!r}{did_you_mean(part.type.text, known)}",
                part.type.position,
                self._valid_types("aspect", part.type.text),
                scope=scope,
            )
            return
        values = self._configuration(f"aspect {name}", cls, part.values, names, part.position, name, scope)
        if not part.at:
            self.problems.add(
                f"aspect {name} does not say where it stands",
                part.position,
                "add 'at:' with ports or patterns",
                scope=scope,
            )
        self.graph.positions[f"aspect {name}"] = part.position
        is_enabled = self._is_enabled(name, scope, part, names)
        weaving = Weaving(self.graph, all_ports, name, cls, scope, self.problems)
        try:
            aspect = None if values is None else cls(**values)
        except (EpicycleError, ValueError) as error:
            self.problems.add(f"aspect {name}: {error}", part.position, scope=scope)
            aspect = None
        if aspect is None:
            weaving.select(part.at)  # for what is wrong with it
            return
        woven = weaving.weave(
            aspect, part.at, lambda name: part.values[name].value.position if name in part.values else None
        )
        if is_enabled:
            self.aspects.append(woven)

    def _is_enabled(self, name: str, scope: str, part: PartText, names: dict[str, object]) -> bool:
        if part.enabled is None:
            return True
        label = f"aspect {name}.enabled"
        value = self.values.of(part.enabled, names, label, scope)
        try:
            return value is self.values.missing or bool(Parameter(bool).convert(value))
        except ParameterError as error:
            self.problems.add(f"{label}: {error}", part.enabled.position, scope=scope)
            return True


def _place(node: Node, error: ParameterError) -> Position:
    """Where in a value, as far as it is written out, an error is."""
    for number, key in enumerate(error.keys, start=1):
        if not isinstance(node, Mapping) or key not in node.entries:
            break
        if error.of_key and number == len(error.keys):
            return node.entries[key].key.position
        node = node.entries[key].value
    return node.position


def _shown(value: object, unit: str) -> object:
    """The value of a parameter of the model, as a plain number in the unit that it declares."""
    return plain(value) if unit else counted_in_si(value)


def _as_meant(given: dict[str, Entry], valid: Collection[str]) -> dict[str, Entry]:
    """The values with misspelled names put right, or else they would seem to be missing as well."""
    result = {name: entry for name, entry in given.items() if name in valid}
    for name, entry in given.items():
        if name not in valid and (meant := nearest(name, valid)) is not None:
            result.setdefault(meant, entry)
    return result
