"""Disturbances that are woven around a finished model."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Mapping as AnyMapping
from dataclasses import replace

from epicycle.aspects import ObservationAspect, PortAspect

from ..catalogue.types import Catalogue, installed
from ..graph.woven import WovenAspect
from ..language.disturbance import COMPOSITE_THERE, PARAMETER_THERE, joined, load_disturbance
from ..language.inheritance import inherit
from ..language.models import CompositeText, ModelText
from ..language.parts import PartText
from ..language.places import PointcutText
from ..language.ports import ParameterText
from ..language.settings import ActText, Setting, Settings, settings_of
from ..language.surroundings import Surroundings
from ..text.patterns import PathIndex, PatternError
from ..text.problems import Problems
from ..text.program import call_site, node_of
from ..text.reading import Text
from .building import Building
from .instantiate import Instantiator, PartTypes
from .paths import Paths
from .resolve import ParameterResolver
from .weave_all import acts_of, weave_all


def disturb(
    model: Building,
    names: Iterable[str],
    values: Iterable[str | Setting] | AnyMapping[str, object],
    types: Iterable[type],
    *,
    only_ports: bool = False,
    at: AnyMapping[str, list[str]] | None = None,
) -> tuple[list[WovenAspect], list[str]]:
    """Weave the aspects of disturbances, which are returned; and what is left out, in words.  Raises ``ModelError``.

    With ``only_ports``, those that do not alter, delay or lose tokens are left out; ``at`` are then ports, by
    direction, in place of those that the disturbances name.  Of aspects with the same name, the last one counts.
    """
    problems, position, catalogue = Problems(), call_site(), installed().with_types(types)
    own = {
        key: replace(model.declared.get(key) or ParameterText(key, position), value=node_of(value, position))
        for key, value in model.parameters.items()
    }
    root, composites = CompositeText(model.name, position, parameters=own), dict[str, CompositeText]()
    exactly: tuple[ActText, ...] | None = None
    left_out: list[str] = []
    for name in names:
        one = problems.whole(load_disturbance(name, problems))
        aspects = one.root.aspects
        if only_ports:
            aspects, unused = _of_ports(one, catalogue, at, Paths(model.graph).ports)
            left_out += unused
            if not aspects:
                message = f"{one.root.name} has no aspect that alters, delays or loses tokens"
                problems.add(message, one.root.position)
        else:
            for setting in one.settings:
                hint = f"load the model together with the disturbance: load_model(..., disturb={name!r})"
                message = f"{setting.path!r} can no longer be set: the model has been built"
                problems.add(message, setting.position, hint)
            for key in sorted({*values} & model.parameters.keys() - one.root.parameters.keys()):
                message = f"{key!r} is a parameter of the model, not of the disturbance {one.root.name}"
                problems.add(message, position)
        parameters = joined(root.parameters, one.root.parameters, PARAMETER_THERE, problems)
        root = replace(root, parameters=parameters, aspects=root.aspects | aspects)
        composites = joined(composites, one.composites, COMPOSITE_THERE, problems)
        exactly = exactly if one.exactly is None else (*(exactly or ()), *one.exactly)
    taken = {woven.name for woven in model.aspects}
    for part in root.aspects.values():
        if part.name in taken:
            problems.add(f"there is already an aspect {part.name!r}", part.position, "unweave it first")
    settings = settings_of(values, problems)
    problems.raise_if_any()
    resolver = ParameterResolver(problems, Settings(settings))
    around = Surroundings(inherit(composites, catalogue.actors, problems), catalogue, problems)
    root = around.composite(root)
    made = Instantiator(PartTypes(around.composites, catalogue), resolver, model.graph.copy())
    made.body("", root, resolver.parameters("", root, {}, {}, None))
    found = weave_all(made)
    resolver.check_unused(made.graph)
    acts = None if exactly is None else acts_of(exactly, [*model.aspects, *found], problems)
    problems.raise_if_any()
    model.adopt(made.graph, found, acts)
    return found, left_out


def _of_ports(
    disturbance: ModelText, catalogue: Catalogue, at: AnyMapping[str, list[str]] | None, ports: PathIndex
) -> tuple[dict[str, PartText], list[str]]:
    """The aspects of a disturbance that alter, delay or lose tokens, and what else there is, in words."""
    of = f"({disturbance.root.name})"
    aspects, left_out = {}, [f"set {setting.path} {of}" for setting in disturbance.settings]
    for key, part in disturbance.root.aspects.items():
        cls = catalogue.aspects.get(part.type.text)
        if cls is not None and (not issubclass(cls, PortAspect) or issubclass(cls, ObservationAspect)):
            left_out.append(f"{key}: {part.type.text} {of}")
            continue
        if at is None:
            part, unmatched = _matched(part, ports)
            left_out += [f"{key} at {text} {of}" for text in unmatched]
        elif cls is not None:
            side = "input" if "input" in cls.stands_at else "output"
            part = replace(part, at=tuple(PointcutText.of(Text(port, part.position)) for port in at[side]))
        aspects[key] = part
    return aspects, left_out


def _matched(part: PartText, ports: PathIndex) -> tuple[PartText, list[str]]:
    """An aspect without the patterns that match no port, if others do; and these patterns."""
    aimed = [each for each in part.at if each and not each.exclude]
    unmatched = [each for each in aimed if each.text and not _matches(each.text, ports)]
    if len(unmatched) == len(aimed):
        return part, []
    left = tuple(each for each in part.at if not each or each not in unmatched)
    return replace(part, at=left), [each.text for each in unmatched]


def _matches(pattern: str, ports: PathIndex) -> bool:
    try:
        return bool(ports.select(pattern))
    except PatternError:
        return True  # which is reported when the aspect is woven
