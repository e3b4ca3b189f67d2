"""From declarations of aspects to the aspects of a model: those of the model itself, its classes and its actors."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from collections.abc import Mapping as AnyMapping
from dataclasses import replace
from functools import partial

from epicycle.actors import Actor, EpicycleError, declared_parameters, did_you_mean, paths
from epicycle.aspects import (
    Aspect,
    CompositeAspect,
    CompositeExecutionAspect,
    Decoration,
    class_decorations,
    decorations,
)

from ..catalogue.types import CatalogueError
from ..graph.acts import ActName
from ..graph.model_graph import ModelGraph
from ..graph.woven import Places, WovenAspect
from ..language.parts import PartText
from ..language.places import PointcutText
from ..language.settings import ActText
from ..language.values import Locals
from ..text.document import Mapping
from ..text.faults import place_in
from ..text.kinds import ASPECT, NO_PLACE, UNKNOWN_TYPE
from ..text.limits import RAISE_IT
from ..text.patterns import TooManyError
from ..text.problems import POISON, Position, Problems
from ..text.reading import Text
from .composite_aspect import OWN, check_nesting, detours, weave_model
from .instantiate import Instantiator, Names
from .paths import Paths
from .weave import Pointcuts


def weave_all(made: Instantiator) -> list[WovenAspect]:
    """Attach all aspects, now that all ports exist, in the order in which tokens meet them."""
    with made.problems.looking_for(ASPECT):
        graph, problems, indexed, found = made.graph, made.problems, Paths(made.graph), list[WovenAspect]()
        for scope, part, names in made.aspects:
            name = paths.join(scope, part.name)
            try:
                if (woven := _declared(made, indexed, name, scope, part, names)) is not None:
                    found.append(woven)
            except TooManyError as error:
                problems.stop(f"aspect {name}: {error}", part.position, RAISE_IT)
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


def _declared(
    made: Instantiator, paths: Paths, name: str, scope: str, part: PartText, names: Names
) -> WovenAspect | None:
    """A declared aspect, attached; None if that is wrong or it is not enabled."""
    if (cls := _type(made, name, scope, part)) is None:
        return None
    graph, resolver, problems = made.graph, made.resolver, made.problems
    is_model = cls in (CompositeAspect, CompositeExecutionAspect)
    given = {key: entry for key, entry in part.values.items() if not is_model or key in OWN}
    aspect = resolver.configured(cls, given, Locals(name, names), f"aspect {name}", part.position, make=cls, path=name)
    if not part.at:
        hint = "add 'at:' with ports or patterns"
        problems.add(f"aspect {name} has no 'at'", part.position, hint, scope=scope, kind=NO_PLACE)
    own = name if is_model and graph.is_composite(name) else ""
    pointcuts = Pointcuts(paths, name, scope, problems, cls, own)
    is_enabled = bool(own) if is_model else resolver.is_enabled(name, part, Locals(scope, names))
    place_of = partial(place_in, Mapping(part.values, part.position))
    if own:
        at = [each and _timed(made, each, name, scope, names) for each in part.at]
        woven = weave_model(pointcuts, aspect, at, place_of, part.position)
    else:
        places, _ = pointcuts.resolve(part.at)
        woven = POISON if aspect is POISON else pointcuts.bind(aspect, places, place_of, part.position)
    if not woven:
        return None
    made.places += len(woven.places)
    limit = graph.limits.places
    if made.places > limit:
        problems.stop(f"aspect {name}: aspects attach to more than {limit:,} places", part.position, RAISE_IT)
    return woven if is_enabled else None


def _type(made: Instantiator, name: str, scope: str, part: PartText) -> type[Aspect] | None:
    """The type of an aspect; None, and a problem, if it cannot have that type."""
    known, wanted = made.known_at(name), part.type.text
    try:
        cls = known.catalogue.aspects.get(wanted)
    except CatalogueError as error:
        made.resolver.blame(f"aspect {name}", error, part.type.position, Locals(scope))
        return None
    if (inner := known.composites.get(wanted)) is not None:
        return None if inner is POISON else _model_type(made, name, scope, part, cls)
    if cls is None:
        near = wanted, [*known.catalogue.aspects, *known.composites]
        message, hints = f"aspect {name}: there is no aspect type {wanted!r}", known.valid_types("aspect", wanted)
        made.problems.add(message, part.type.position, *hints, scope=scope, kind=UNKNOWN_TYPE, near=near)
        return None
    for pointcut in (each for each in part.at if each):
        for key, said in (("request", pointcut.request), ("time", pointcut.time)):
            if said is not None:
                message = f"aspect {name}: {wanted} is not a composite, so its pointcuts have no {key!r}"
                made.problems.add(message, said.position, scope=scope)
    return cls


def _model_type(
    made: Instantiator, name: str, scope: str, part: PartText, namesake: type[Aspect] | None
) -> type[Aspect] | None:
    """Whether an aspect that is a composite attaches to ports or to actors."""
    if namesake is not None:
        message = f"aspect {name}: {part.type.text} is both an aspect type and a composite"
        made.problems.add(message, part.type.position, "give the composite another name", scope=scope)
        return None
    aimed = [pointcut for pointcut in part.at if pointcut and not pointcut.exclude]
    at_ports = [pointcut for pointcut in aimed if pointcut.time is None]
    if at_ports and len(at_ports) < len(aimed):
        message = f"aspect {name}: it attaches to ports here, but to actors elsewhere"
        hint = "give every place a time, or none: at actors it is the execution time of their firings"
        made.problems.add(message, at_ports[0].position, hint, scope=scope)
        made.graph.leave_open(name)
        return None
    return CompositeExecutionAspect if aimed and not at_ports else CompositeAspect


def _timed(made: Instantiator, pointcut: PointcutText, name: str, scope: str, names: dict[str, object]) -> PointcutText:
    if pointcut.time is None:
        return pointcut
    time = made.resolver.value(pointcut.time, Locals(scope, names), f"aspect {name}: time")
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
    named, _ = pointcuts.resolve([PointcutText.of(Text(each, position)) for each in at_parameter])
    places = Places(
        ports=[own[port].path for port in decoration.ports if port in own],
        actors={} if decoration.ports else {actor.path: actor.path},
        parameters=named.parameters,
    )
    return replace(pointcuts.bind(aspect, places, lambda _: position, position), comes_with_actor=True)


def arranged(aspects: list[WovenAspect], graph: ModelGraph) -> list[WovenAspect]:
    """The aspects in the order in which tokens meet them.

    Those that come with an actor are a part of it: at its outputs they act before the others, the first one given
    nearest to the actor; at its inputs and firings, after them.
    """
    return sorted(aspects, key=lambda each: (1, -1)[_is_at_outputs(each, graph)] if each.comes_with_actor else 0)


def _is_at_outputs(woven: WovenAspect, graph: ModelGraph) -> bool:
    return bool(woven.ports) and all(graph.direction(port) == "output" for port in woven.ports)


_FEW = 8  # places that a message lists


def acts_of(texts: Iterable[ActText], aspects: Iterable[WovenAspect], problems: Problems) -> frozenset[ActName]:
    """The names of acts; unknown aspects and places are problems."""
    places = {woven.name: woven.places for woven in aspects}
    found = set()
    for each in texts:
        aspect, place = each.aspect.text, each.at.text
        if aspect not in places:
            message = f"exactly: there is no aspect {aspect!r}{did_you_mean(aspect, places)}"
            problems.add(message, each.aspect.position, f"the aspects: {', '.join(places) or 'none'}")
        elif place not in places[aspect]:
            known = places[aspect]
            rest = f" and {len(known) - _FEW} more" if len(known) > _FEW else ""
            message = f"exactly: aspect {aspect} does not attach to {place!r}{did_you_mean(place, known)}"
            problems.add(message, each.at.position, f"it attaches to {', '.join(known[:_FEW])}{rest}")
        else:
            found.add(ActName(aspect, place, each.token))
    return frozenset(found)
