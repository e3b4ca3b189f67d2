"""From declarations of aspects to the aspects of a model: those of the model itself, its classes and its actors."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Mapping as AnyMapping
from dataclasses import replace
from functools import partial

from epicycle.actors import Actor, EpicycleError, declared_parameters, did_you_mean
from epicycle.aspects import (
    Aspect,
    CompositeAspect,
    CompositeExecutionAspect,
    Decoration,
    class_decorations,
    decorations,
)

from ..catalogue.types import CatalogueError
from ..graph.model_graph import ModelGraph
from ..graph.woven import WovenAspect
from ..language.parts import PartText
from ..language.places import PointcutText
from ..language.values import Locals
from ..text.document import Mapping
from ..text.faults import place_in
from ..text.limits import RAISE_IT
from ..text.patterns import TooManyError
from ..text.problems import POISON, Position, Problems
from ..text.reading import Text
from .composite_aspect import OWN, check_nesting, detours, weave_model
from .instantiate import Instantiator, Names
from .paths import Paths
from .weave import Places, Pointcuts, bind


def weave_all(made: Instantiator) -> list[WovenAspect]:
    """Attach all aspects, now that all ports exist, in the order in which tokens meet them."""
    weaver, graph, problems = _Weaver(made), made.graph, made.problems
    for scope, part, names in made.aspects:
        name = f"{scope}.{part.name}" if scope else part.name
        try:
            weaver.weave(name, scope, part, names)
        except TooManyError as error:
            problems.stop(f"aspect {name}: {error}", part.position, RAISE_IT)
    found = weaver.found
    decorated = {cls for cls in set(map(type, made.actors)) if class_decorations(cls)}
    for actor in made.actors:
        if type(actor) in decorated:
            position = graph.components[actor.path].position
            assert position is not None, "all that is unfolded is written somewhere"
            found += weave_decorations(actor, made.graph, problems, position, made.resolver.set_from_outside)
    found = arranged(found, graph)
    if check_nesting(found, graph, problems):
        graph.detours = detours(graph, found)
    return found


class _Weaver:
    """Weaves the declared aspects one after the other."""

    def __init__(self, made: Instantiator) -> None:
        self.made = made
        self.graph = made.graph
        self.resolver = made.resolver
        self.problems = made.problems
        self.paths = Paths(made.graph)
        self.found: list[WovenAspect] = []

    def weave(self, name: str, scope: str, part: PartText, names: Names) -> None:
        cls = self._type(name, scope, part)
        if cls is None:
            return
        is_model = cls in (CompositeAspect, CompositeExecutionAspect)
        given = {key: entry for key, entry in part.values.items() if not is_model or key in OWN}
        local = Locals(name, names)
        aspect = self.resolver.configured(cls, replace(part, values=given), local, f"aspect {name}", cls)
        if not part.at:
            hint = "add 'at:' with ports or patterns"
            self.problems.add(f"aspect {name} has no 'at'", part.position, hint, scope=scope)
        own = name if is_model and self.graph.is_composite(name) else ""
        pointcuts = Pointcuts(self.paths, name, scope, self.problems, cls, own)
        is_enabled = bool(own) if is_model else self.resolver.is_enabled(name, part, Locals(scope, names))
        place_of = partial(place_in, Mapping(part.values, part.position))
        if own:
            at = [each and self._timed(each, name, scope, names) for each in part.at]
            woven = weave_model(pointcuts, aspect, at, place_of, part.position)
        else:
            places = pointcuts.resolve(part.at)
            woven = POISON if aspect is POISON else bind(pointcuts, aspect, places, place_of, part.position)
        if not woven:
            return
        self.made.places += len(woven.places)
        limit = self.graph.limits.places
        if self.made.places > limit:
            self.problems.stop(f"aspect {name}: aspects attach to more than {limit:,} places", part.position, RAISE_IT)
        if is_enabled:
            self.found.append(woven)

    def _type(self, name: str, scope: str, part: PartText) -> type[Aspect] | None:
        """The type of an aspect; None, and a problem, if it cannot have that type."""
        known, wanted = self.made.known_at(name), part.type.text
        try:
            cls = known.catalogue.aspects.get(wanted)
        except CatalogueError as error:
            self.resolver.values.blame(f"aspect {name}", error, part.type.position, Locals(scope))
            return None
        if (inner := known.composites.get(wanted)) is not None:
            return None if inner is POISON else self._model_type(name, scope, part, cls)
        if cls is None:
            near = did_you_mean(wanted, [*known.catalogue.aspects, *known.composites])
            message = f"aspect {name}: there is no aspect type {wanted!r}{near}"
            self.problems.add(message, part.type.position, *known.valid_types("aspect", wanted), scope=scope)
            return None
        for pointcut in (each for each in part.at if each):
            for key, said in (("request", pointcut.request), ("time", pointcut.time)):
                if said is not None:
                    message = f"aspect {name}: {wanted} is not a composite, so its pointcuts have no {key!r}"
                    self.problems.add(message, said.position, scope=scope)
        return cls

    def _model_type(self, name: str, scope: str, part: PartText, namesake: type[Aspect] | None) -> type[Aspect] | None:
        """Whether an aspect that is a composite attaches to ports or to actors."""
        if namesake is not None:
            message = f"aspect {name}: {part.type.text} is both an aspect type and a composite"
            self.problems.add(message, part.type.position, "give the composite another name", scope=scope)
            return None
        aimed = [pointcut for pointcut in part.at if pointcut and not pointcut.exclude]
        at_ports = [pointcut for pointcut in aimed if pointcut.time is None]
        if at_ports and len(at_ports) < len(aimed):
            message = f"aspect {name}: it attaches to ports here, but to actors elsewhere"
            hint = "give every place a time, or none: at actors it is the execution time of their firings"
            self.problems.add(message, at_ports[0].position, hint, scope=scope)
            self.graph.leave_open(name)
            return None
        return CompositeExecutionAspect if aimed and not at_ports else CompositeAspect

    def _timed(self, pointcut: PointcutText, name: str, scope: str, names: dict[str, object]) -> PointcutText:
        if pointcut.time is None:
            return pointcut
        time = self.resolver.values.value(pointcut.time, Locals(scope, names), f"aspect {name}: time")
        return replace(pointcut, firing_time=time or 0.0)


Change = Callable[[str, Aspect], AnyMapping[str, object]]


def weave_decorations(
    actor: Actor, graph: ModelGraph, problems: Problems, position: Position, change: Change | None = None
) -> list[WovenAspect]:
    """The aspects that come with an actor; ``change`` returns the parameters that are set from outside."""
    before: list[WovenAspect] = []
    behind: list[WovenAspect] = []
    for each in decorations(actor):
        woven = _weave(actor, each, graph, problems, position, change)
        if woven is not None and _is_at_outputs(woven, graph):
            before.append(woven)
        elif woven is not None:
            behind.insert(0, woven)
    return [*before, *behind]


def _weave(
    actor: Actor,
    decoration: Decoration,
    graph: ModelGraph,
    problems: Problems,
    position: Position,
    change: Change | None,
) -> WovenAspect | None:
    name, aspect = f"{actor.path}.{decoration.name}", decoration.aspect
    own = {**actor.inputs, **actor.outputs}
    at_parameter = [each for each in decoration.ports if each not in own and each in declared_parameters(type(actor))]
    missing = [port for port in decoration.ports if port not in own and port not in at_parameter]
    if missing:
        ports = ", ".join(own) or "none"
        problems.add(f"aspect {name}: {actor.path} has no port {missing[0]!r}", position, f"its ports: {ports}")
        return None
    changed = {} if change is None else change(name, aspect)
    if changed:
        values = {each: vars(aspect)[each] for each in declared_parameters(type(aspect))}
        try:
            aspect = type(aspect)(**{**values, **changed})
        except EpicycleError as error:
            problems.add(f"aspect {name}: {error}", position)
            return None
    paths = Paths(graph, [port.path for port in own.values()])
    pointcuts = Pointcuts(paths, name, actor.path, problems, type(aspect))
    named = pointcuts.resolve([PointcutText.of(Text(each, position)) for each in at_parameter])
    places = Places(
        [own[port].path for port in decoration.ports if port in own],
        actors={} if decoration.ports else {actor.path: actor.path},
        parameters=named.parameters,
    )
    return replace(bind(pointcuts, aspect, places, lambda _: position, position), comes_with_actor=True)


def arranged(aspects: list[WovenAspect], graph: ModelGraph) -> list[WovenAspect]:
    """The aspects in the order in which tokens meet them.

    Those that come with an actor are a part of it: at its outputs they act before the others, the first one given
    nearest to the actor; at its inputs and firings, after them.
    """
    return sorted(aspects, key=lambda each: (1, -1)[_is_at_outputs(each, graph)] if each.comes_with_actor else 0)


def _is_at_outputs(woven: WovenAspect, graph: ModelGraph) -> bool:
    return bool(woven.ports) and all(graph.direction(port) == "output" for port in woven.ports)
