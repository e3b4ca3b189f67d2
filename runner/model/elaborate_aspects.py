"""From the declarations of aspects to aspects that stand in a model: those of the model, its classes and its actors."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from functools import partial

from epicycle.actors import Actor, Parameter, ParameterError
from epicycle.aspects import (
    Aspect,
    CompositeAspect,
    CompositeExecutionAspect,
    FiringTimeParameter,
    class_decorations,
)

from ..catalogue import Catalogue, CatalogueError
from ..language import CompositeText, PartText, PointcutText, Settings
from ..text import RAISE_IT, Position, Problems, TooManyError, did_you_mean
from .composite_aspect import OWN, ModelWeaving, check_nesting, detours
from .configuration import Configurator, place_of
from .decorated import arranged, weave_decorations
from .weave import Paths, Weaving
from .woven import WovenAspect

MAX_SHOWN = 12  # types in one message
OF_YOUR_OWN = "one of your own is known after '--types FILE.py'; in Python, give its class as types=[...]"


class AspectElaborator(Configurator):
    """Weaves what a model declares, once all its ports exist."""

    def __init__(
        self,
        composites: dict[str, CompositeText],
        settings: Settings,
        problems: Problems,
        catalogue: Catalogue,
        broken: Collection[str],
    ) -> None:
        super().__init__(settings, problems)
        self.composites = composites
        self.broken = broken  # composites that are there, but lack what they extend
        self.catalogue = catalogue
        self.aspects: list[WovenAspect] = []
        self._places = 0
        # What is to be woven: (name, scope, declaration, names), and the actors, whose classes may be decorated.
        self._to_weave: list[tuple[str, str, PartText, dict[str, object]]] = []
        self._actors: list[Actor] = []

    def _weave(self) -> None:
        """Let all aspects stand where they are to, now that all ports exist."""
        paths = Paths(self.graph)
        for name, scope, part, names in self._to_weave:
            try:
                self._aspect(name, scope, part, names, paths)
            except TooManyError as error:
                self.problems.add(f"aspect {name}: {error}", part.position, RAISE_IT)
                self.problems.raise_if_any()
        decorated = {cls for cls in set(map(type, self._actors)) if class_decorations(cls)}
        for actor in self._actors:
            if type(actor) in decorated and self.graph.actors.get(actor.path) is actor:
                position = self.graph.positions[actor.path]
                self.aspects += weave_decorations(actor, self.graph, self.problems, position, self._set_from_outside)
        self.aspects = arranged(self.aspects, self.graph)
        if check_nesting(self.aspects, self.graph, self.problems):
            self.graph.detours = detours(self.graph, self.aspects)

    def _aspect(self, name: str, scope: str, part: PartText, names: dict[str, object], paths: Paths) -> None:
        cls = self._aspect_type(name, scope, part)
        if cls is None:
            return
        is_model = cls in (CompositeAspect, CompositeExecutionAspect)
        given = {key: entry for key, entry in part.values.items() if not is_model or key in OWN}
        values = self._configuration(f"aspect {name}", cls, given, names, part.position, name, scope)
        if not part.at:
            self.problems.add(
                f"aspect {name} does not say where it stands",
                part.position,
                "add 'at:' with ports or patterns",
                scope=scope,
            )
        self.graph.positions[f"aspect {name}"] = part.position
        weaving = Weaving(self.graph, paths, name, cls, scope, self.problems)
        if is_model and name in self.graph.composites:
            weaving = ModelWeaving(self.graph, paths, name, name, scope, self.problems, part.position, cls)
            part = replace(part, at=[self._timed(pointcut, name, scope, names) for pointcut in part.at])
        is_enabled = name in self.graph.composites if is_model else self._is_enabled(name, scope, part, names)
        try:
            aspect = None if values is None else cls(**values)
        except Exception as error:  # whatever an aspect's own __init__ does
            self._blame(f"aspect {name}", error, part.position, scope)
            aspect = None
        if aspect is None:
            weaving.select(part.at)  # for what is wrong with it
            if isinstance(weaving, ModelWeaving):
                self.graph.leave_open(name)
            return
        woven = weaving.weave(aspect, part.at, partial(_position, part))
        if isinstance(weaving, ModelWeaving):
            weaving.check(woven)
            weaving.connect(woven)
        self._places += len(woven.places)
        limit = self.graph.limits.places
        if self._places > limit:
            self.problems.add(f"aspect {name}: aspects stand at more than {limit:,} places", part.position, RAISE_IT)
            self.problems.raise_if_any()
        if is_enabled:
            self.aspects.append(woven)

    def _aspect_type(self, name: str, scope: str, part: PartText) -> type[Aspect] | None:
        known, wanted = self.catalogue.aspects, part.type.text
        if wanted in self.broken:
            return None
        try:
            cls = known.get(wanted)
        except CatalogueError as error:
            self.problems.add(f"aspect {name}: {error.message}", part.type.position, *error.help, scope=scope)
            return None
        if wanted in self.composites:
            if cls is not None:
                self.problems.add(
                    f"aspect {name}: {wanted} is an aspect type and a composite",
                    part.type.position,
                    "give the composite another name",
                    scope=scope,
                )
                return None
            timed = [pointcut.time is not None for pointcut in part.at if not pointcut.exclude]
            if any(timed) and not all(timed):
                where = next(each for each in part.at if not each.exclude and each.time is None)
                self.problems.add(
                    f"aspect {name}: it stands at ports here, and elsewhere at actors",
                    where.position,
                    "give every place a time, or none: actors have one, the execution time of their firings",
                    scope=scope,
                )
                self.graph.leave_open(name)
                return None
            return CompositeExecutionAspect if any(timed) else CompositeAspect
        if cls is None:
            self.problems.add(
                f"aspect {name}: there is no aspect type {wanted!r}{did_you_mean(wanted, [*known, *self.composites])}",
                part.type.position,
                *self._valid_types("aspect", wanted),
                scope=scope,
            )
            return None
        for pointcut in part.at:
            for key, said in (("request", pointcut.request), ("time", pointcut.time)):
                if said is not None:
                    self.problems.add(
                        f"aspect {name}: {wanted} is no composite, so a pointcut of it has no {key!r}",
                        said.position,
                        scope=scope,
                    )
        return cls

    def _timed(self, pointcut: PointcutText, name: str, scope: str, names: dict[str, object]) -> PointcutText:
        """The pointcut with its execution time."""
        if pointcut.time is None:
            return pointcut
        label = f"aspect {name}: time"
        value = self.values.of(pointcut.time, names, label, scope)
        try:
            time = 0.0 if value is self.values.missing else FiringTimeParameter().convert(value)
        except ParameterError as error:
            position = place_of(pointcut.time, error.keys, of_key=error.of_key)
            self.problems.add(f"{label}: {error}", position, scope=scope)
            return pointcut
        return replace(pointcut, firing_time=time or 0.0)

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

    def _valid_types(self, kind: str, asked: str) -> tuple[str, ...]:
        """Which types there are: their names, or how to see them if they are too many; and how there can be more."""
        is_actor = kind == "actor"
        types: Collection[str] = self.catalogue.actors if is_actor else self.catalogue.aspects
        others: Collection[str] = self.catalogue.aspects if is_actor else self.catalogue.actors
        if asked in others:
            other = "aspect" if is_actor else "actor"
            return (f"{asked} is an {other}: it belongs under '{other}s'",)
        composites = sorted(self.composites) if is_actor else []
        if len(composites) + len(types) <= MAX_SHOWN:
            valid = ", ".join(sorted([*composites, *types]))
        else:
            own = ", ".join(composites[:MAX_SHOWN]) + (", ..." if len(composites) > MAX_SHOWN else "")
            valid = f"{f'{own}, and ' if own else ''}those that 'epicycle {kind}s' lists"
        return f"valid types: {valid}", OF_YOUR_OWN


def _position(part: PartText, name: str, *keys: str) -> Position | None:
    """Where a declaration sets a parameter, or a key in it."""
    return place_of(part.values[name].value, keys, of_key=True) if name in part.values else None
