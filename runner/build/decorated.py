"""Aspects that come with actors: they stand where a class or instance was decorated, as if the model declared them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from epicycle.actors import Actor, EpicycleError, declared_parameters
from epicycle.aspects import Aspect, Decoration, decorations

from ..graph import ModelGraph, WovenAspect
from ..language import PointcutText
from ..text import Position, Problems, Text
from .draft import Draft
from .paths import Paths
from .weave import Weaving

Change = Callable[[str, Aspect], Mapping[str, object]]


def weave_decorations(
    actor: Actor, draft: Draft, problems: Problems, position: Position, change: Change | None = None
) -> list[WovenAspect]:
    """The aspects that come with an actor; ``change`` tells the parameters that are set from outside."""
    before: list[WovenAspect] = []
    behind: list[WovenAspect] = []
    for each in decorations(actor):
        woven = _weave(actor, each, draft, problems, position, change)
        if woven is not None and _is_at_outputs(woven, draft.graph):
            before.append(woven)
        elif woven is not None:
            behind.insert(0, woven)
    return [*before, *behind]


def _weave(
    actor: Actor, decoration: Decoration, draft: Draft, problems: Problems, position: Position, change: Change | None
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
    paths = Paths(draft, [port.path for port in own.values()])
    pointcuts = [PointcutText.of(Text(each, position)) for each in at_parameter]
    weaving = Weaving(draft, paths, name, actor.path, problems, type(aspect))
    woven = replace(
        weaving.weave(aspect, pointcuts, lambda *_: position),
        ports=[own[port].path for port in decoration.ports if port in own],
        actors={} if decoration.ports else {actor.path: actor.path},
        comes_with_actor=True,
    )
    weaving.check_times(woven, lambda *_: position)
    draft.graph.positions.setdefault(f"aspect {name}", position)
    return woven


def arranged(aspects: list[WovenAspect], graph: ModelGraph) -> list[WovenAspect]:
    """The aspects in the order in which tokens meet them.

    Those that come with an actor are a part of it: at its outputs they stand before the others, the one that was given
    first nearest to the actor; at its inputs and firings behind them.
    """
    return sorted(aspects, key=lambda each: (1, -1)[_is_at_outputs(each, graph)] if each.comes_with_actor else 0)


def _is_at_outputs(woven: WovenAspect, graph: ModelGraph) -> bool:
    return bool(woven.ports) and all(graph.direction(port) == "output" for port in woven.ports)
