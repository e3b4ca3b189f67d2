"""From declarations to a checked model: parameters resolved, composites unfolded, actors made, ports wired.

What is wrong is noted and worked around, so that one load tells it all: a wrong value becomes ``missing`` and what is
computed from it is not judged; an actor that cannot be made leaves its ports in the graph, for others to connect to.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from epicycle.actors import (
    Actor,
    Parameter,
    ParameterError,
    counted_in_si,
    plain,
    to_nanoseconds,
)

from ..catalogue import Catalogue, CatalogueError, PortTypeError, read_type, token_types
from ..language import CompositeText, ModelText, PartText, PortText, Settings
from ..text import NORMAL, RAISE_IT, Entry, Limits, Mapping, Position, Problems, did_you_mean
from .checks import check
from .composite_aspect import as_actor
from .elaborate_aspects import AspectElaborator
from .graph import ModelGraph
from .model import Model
from .observation import Observation
from .wiring import Child, Wiring
from .woven import WovenAspect, check_processors

MAX_DEPTH = 50


class TooLargeError(Exception):
    """The model has too many parts to go on; the reason has been noted."""


class Elaborator(AspectElaborator):
    """Unfolds one model; problems are collected, and the model is good only if there are none."""

    def __init__(
        self,
        text: ModelText,
        composites: dict[str, CompositeText],
        settings: Settings,
        problems: Problems,
        catalogue: Catalogue,
        broken: Collection[str] = (),
        limits: Limits = NORMAL,
    ) -> None:
        super().__init__(composites, settings, problems, catalogue, broken)
        self.graph.limits = limits
        self.text = text
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
        self._weave()
        for setting in self.settings.unused():
            self._add_unused(setting)
        check(self.graph, self.problems)
        check_processors(self.aspects, self.graph, self.problems)
        model = Model(root.name, doc=root.doc)
        model.graph, model.aspects = self.graph, self.aspects
        model.warnings = self.problems.warnings
        model.parameters = {name: _shown(value, root.parameters[name].unit) for name, value in names.items()}
        model.declared = {name: (text.unit, text.doc) for name, text in root.parameters.items()}
        Observation(model, self.values, self.problems).read(self.text, names)
        for name, part in self.text.figures.items():
            values = {
                key: self.values.of(entry.value, names, f"figure {name}.{key}") for key, entry in part.values.items()
            }
            if not any(value is self.values.missing for value in values.values()):
                in_si = {key: counted_in_si(value) for key, value in values.items()}
                model.figures[name] = (part.type.text, in_si, Mapping(part.values, part.type.position))
        return model

    def woven(self, graph: ModelGraph) -> list[WovenAspect]:
        """The aspects that the text declares, woven around a graph that is there."""
        self.graph = graph
        names = self._parameters("", self.text.root, {}, {}, None)
        self._body("", self.text.root, names, ())
        self._weave()
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
        self._weave()
        return self.aspects

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
        for name, part in composite.aspects.items():
            if part.type.text in self.composites and (
                model := self._aspect_model(path, composite, part, names, within)
            ):
                children[name] = model
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
                *self._valid_types("actor", part.type.text),
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
        limit = self.graph.limits.actors
        if self._instances > limit:
            self.problems.muted = False
            self.problems.add(
                f"{path}: the model has more than {limit:,} actors and composites", part.position, RAISE_IT
            )
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
            return Parameter(int, min=0, max=self.graph.limits.actors).convert(value)
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
                self._actors.append(actor)
                self.graph.add_actor(actor, part.position)
                return actor
            except Exception as error:  # whatever an actor's own __init__ does
                self._blame(path, error, part.position, composite)
        self.graph.add_unmade(path, actor_type)
        return None

    # -- aspects ------------------------------------------------------------------------------------

    def _aspect_model(
        self, path: str, composite: CompositeText, part: PartText, names: dict[str, object], within: tuple[str, ...]
    ) -> Child | None:
        """Make the composite that an aspect is; one that is not enabled is made for trial alone."""
        full = f"{path}.{part.name}" if path else part.name
        is_port = part.name in composite.inputs or part.name in composite.outputs
        if is_port or part.name in composite.actors or full in self.graph.actors or full in self.graph.composites:
            clash = "a port" if is_port else "an actor"
            self.problems.add(
                f"{full!r} is the name of {clash} and of an aspect that is a model", part.position, "rename one"
            )
            return None
        if self._is_enabled(full, path, part, names):
            return self._actor(full, path, as_actor(part), names, within)
        graph, mark = self.graph, len(self._to_weave)
        self.graph = ModelGraph()
        self.graph.limits = graph.limits
        self._actor(full, path, as_actor(part), names, within)
        self.graph = graph
        del self._to_weave[mark:]
        self.graph.unknown.add(full)
        return None


def _shown(value: object, unit: str) -> object:
    """The value of a parameter of the model, as a plain number in the unit that it declares."""
    return plain(value) if unit else counted_in_si(value)
