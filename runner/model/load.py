"""Finding and reading models: a path, or the name of a packaged model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from ..catalogue import installed
from ..collection import without_collection
from ..language import (
    Setting,
    Settings,
    add_disturbances,
    change_aspect,
    check_usage,
    included_composites,
    inherit,
    load_disturbances,
    parse_setting,
    read_model,
    read_overrides,
    settings_in,
    without,
)
from ..text import NORMAL, Limits, Problems, call_site, node_of
from ..text import Mapping as MappingNode
from .elaborate import Elaborator
from .model import Model
from .trial import try_classes


def load_model(
    name: str | Path,
    *,
    set: Iterable[str | Setting] | Mapping[str, object] = (),
    overrides: str | Path | Iterable[str | Path] = (),
    aspects: Iterable[str] = (),
    without_aspects: Iterable[str] = (),
    disturb: str | Path | Iterable[str | Path] = (),
    types: Iterable[type] = (),
    max_actors: int = NORMAL.actors,
) -> Model:
    """Read, change and check a model; raises ``ModelError`` with all that is wrong.

    ``set`` gives parameters their values, as texts like ``"observer[*].sensor.range=5 m"`` or as a mapping
    ``{"observer[*].sensor.range": 5}``; ``overrides`` names a YAML file of such settings, or several; of all that fit
    a parameter the last one wins, and ``set`` wins over files.  ``disturb`` names packaged disturbances, or files of
    aspects, which are added to the model's one after the other; ``without_aspects`` and ``aspects`` count after that,
    and all settings win over what a disturbance sets.  ``types`` are actor and aspect classes of your own that the
    model may name beside the installed ones.  ``max_actors`` is how many actors and composites are not taken for a
    mistake, and a fifth of how many connections.  What is odd but not wrong is in ``Model.warnings``.
    """
    problems, limits = Problems(), Limits(max_actors)
    settings = [each for file in _several(overrides) for each in read_overrides(Path(file), problems)]
    settings += _settings(set, problems)
    with without_collection():
        text, path, reader = read_model(str(name), problems)
        declared = included_composites(text, path, reader, problems)
        catalogue = installed().with_types(types)
        disturbances = load_disturbances(map(str, _several(disturb)), declared, problems)
        composites, broken = inherit(declared, catalogue.actors, problems, limits)
        check_usage(text, declared, composites, catalogue.actors, problems)
        # What disturbances set comes first, for the last one wins.
        settings = add_disturbances(text, disturbances, problems) + settings
        for change in without_aspects:
            without(text, change, problems)
        for change in aspects:
            change_aspect(text, change, problems)
        elaborator = Elaborator(text, composites, Settings(settings, limits), problems, catalogue, broken, limits)
        model = elaborator.model()
        try_classes(composites, elaborator, broken)
        if model.figures:
            from ..show import figures_of  # here, for what is shown stands on what is run, and this on models

            figures_of(model, problems)
        problems.raise_if_any()
        model.warnings = problems.warnings
        model.is_checked = True
        return model


def _several(given: str | Path | Iterable[str | Path]) -> list[str | Path]:
    return [given] if isinstance(given, (str, Path)) else list(given)


def _settings(given: Iterable[str | Setting] | Mapping[str, object], problems: Problems) -> list[Setting]:
    if not isinstance(given, Mapping):
        read = (parse_setting(each, problems) if isinstance(each, str) else each for each in given)
        return [setting for setting in read if setting is not None]
    node = node_of(given, call_site())
    assert isinstance(node, MappingNode)
    return settings_in(node, problems)
