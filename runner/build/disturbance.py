"""Disturbances that are woven around a finished model."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Mapping as AnyMapping

from ..catalogue import installed
from ..graph import ActName, WovenAspect
from ..language import (
    PARAMETER_THERE,
    CompositeText,
    ParameterText,
    Settings,
    inherit,
    joined,
    load_disturbance,
    settings_in,
)
from ..text import Mapping, Position, Problems, node_of
from .acts import acts_of
from .draft import Draft
from .scope import Building
from .settle import Settler
from .unfold import Known, Unfolding
from .weave_all import weave_all


def disturb(
    model: Building, name: str, values: AnyMapping[str, object], types: Iterable[type], position: Position
) -> tuple[Draft, list[WovenAspect], frozenset[ActName] | None]:
    """The model's draft with the aspects of a disturbance, these aspects, and the only acts; raises ``ModelError``."""
    problems = Problems()
    disturbance = load_disturbance(name, problems)
    problems.raise_if_any()
    assert disturbance is not None, "what cannot be read is a problem"
    own = {key: ParameterText(key, position, node_of(value, position)) for key, value in model.parameters.items()}
    parameters = joined(own, disturbance.text.parameters, PARAMETER_THERE, problems)
    root = CompositeText(model.name, position, parameters=parameters, aspects=disturbance.text.aspects)
    for setting in disturbance.settings:
        hint = f"load the model together with the disturbance: load_model(..., disturb={name!r})"
        problems.add(f"{setting.path!r} can no longer be set: the model has been built", setting.position, hint)
    for key in sorted(values.keys() & model.parameters.keys() - disturbance.text.parameters.keys()):
        problems.add(f"{key!r} is a parameter of the model, not of the disturbance {disturbance.text.name}", position)
    taken = {woven.name for woven in model.aspects}
    for part in disturbance.text.aspects.values():
        if part.name in taken:
            problems.add(f"there is already an aspect {part.name!r}", part.position, "unweave it first")
    problems.raise_if_any()
    node = node_of(values, position)
    settler = Settler(Settings(settings_in(node, problems) if isinstance(node, Mapping) else []), problems)
    catalogue = installed().with_types(types)
    composites, broken = inherit(disturbance.composites, catalogue.actors, problems)
    made = Unfolding(Known(composites, catalogue, broken), settler, model.draft.copy())
    made.body("", root, settler.parameters("", root, {}, {}, None))
    found = weave_all(made)
    settler.check_unused(made.draft)
    exactly = disturbance.exactly
    acts = None if exactly is None else acts_of(exactly, [*model.aspects, *found], problems)
    problems.raise_if_any()
    return made.draft, found, acts
