"""Disturbances that are woven around a model that is made."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Mapping as AnyMapping
from typing import TYPE_CHECKING

from ..catalogue import installed
from ..language import (
    CompositeText,
    ModelText,
    ParameterText,
    Settings,
    add_parameters,
    inherit,
    load_disturbance,
    settings_in,
)
from ..text import Mapping, Position, Problems, node_of
from .elaborate import Elaborator
from .woven import WovenAspect

if TYPE_CHECKING:
    from .model import Model


def disturb(
    model: Model, name: str, values: AnyMapping[str, object], types: Iterable[type], position: Position
) -> list[WovenAspect]:
    """Weave the aspects of a disturbance around a model that is made; raises ``ModelError``."""
    problems = Problems()
    disturbance = load_disturbance(name, problems)
    problems.raise_if_any()
    assert disturbance is not None, "what cannot be read is a problem"
    root = CompositeText(model.name, position)
    for key, value in model.parameters.items():
        root.parameters[key] = ParameterText(key, position, node_of(value, position))
    add_parameters(disturbance.text, root, problems)
    for setting in disturbance.settings:
        problems.add(
            f"{setting.path!r} cannot be set any more: the model is made",
            setting.position,
            f"load the model together with the disturbance: load_model(..., disturb={name!r})",
        )
    for key in sorted(values.keys() & model.parameters.keys() - disturbance.text.parameters.keys()):
        problems.add(f"{key!r} is a parameter of the model, not of the disturbance {disturbance.text.name}", position)
    taken = {woven.name for woven in model.aspects}
    for part in disturbance.text.aspects.values():
        root.aspects[part.name] = part
        if part.name in taken:
            problems.add(f"there is an aspect {part.name!r} already", part.position, "unweave it before")
    problems.raise_if_any()
    node = node_of(values, position)
    settings = Settings(settings_in(node, problems) if isinstance(node, Mapping) else [])
    catalogue = installed().with_types(types)
    composites, broken = inherit(disturbance.composites, catalogue.actors, problems)
    found = Elaborator(ModelText(root), composites, settings, problems, catalogue, broken).woven(model.graph)
    problems.raise_if_any()
    return found
