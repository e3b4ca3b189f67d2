"""Finding and reading models: a path, or the name of a packaged model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypedDict, Unpack

from epicycle.actors import counted_in_si, plain

from ...support.collection import without_collection
from ..catalogue.types import installed
from ..graph.model_graph import ModelGraph
from ..graph.woven import check_processors
from ..language.disturbance import (
    COMPOSITE_THERE,
    add_disturbances,
    change_aspect,
    joined,
    load_disturbances,
    only_acts,
    without,
)
from ..language.files import read_model
from ..language.inheritance import inherit
from ..language.models import ModelText
from ..language.settings import Setting, Settings, read_overrides, settings_of
from ..language.surroundings import Surroundings
from ..language.usage import check_usage
from ..language.values import Locals, Values
from ..text.document import Mapping as MappingNode
from ..text.files import noting
from ..text.kinds import ASPECT, CLASS, FIGURE, ODD, OUTPUT, OUTSIDE, VALUE
from ..text.limits import NORMAL, Limits
from ..text.problems import POISON, Problems
from .building import Origin
from .checks import check
from .figures import figures_of
from .instantiate import Instantiator, PartTypes, TooLargeError
from .model import DeclaredFigure, Model
from .outputs import OutputReader
from .resolve import ParameterResolver
from .untried import try_classes
from .weave_all import acts_of, weave_all


class ModelChanges(TypedDict, total=False):
    """What a model may be changed by while it is loaded."""

    set: Iterable[str | Setting] | Mapping[str, object]
    overrides: str | Path | Iterable[str | Path]
    aspects: Iterable[str]
    without_aspects: Iterable[str]
    disturb: str | Path | Iterable[str | Path]
    types: Iterable[type]
    max_actors: int
    partial: bool


def load_model(name: str | Path, **changes: Unpack[ModelChanges]) -> Model:
    """Read, change and check a model; raises ``ModelError`` with everything that is wrong.

    ``set`` gives parameters their values, as texts like ``"observer[*].sensor.range=5 m"`` or as a mapping
    ``{"observer[*].sensor.range": 5}``; ``overrides`` names a YAML file of such settings, or several; of several that
    match a parameter, the last one wins, and ``set`` wins over files.  ``disturb`` names packaged disturbances, or
    files of aspects, which are added to the model's aspects one after the other; ``without_aspects`` and ``aspects``
    apply after that, and all settings win over what a disturbance sets.  A setting, too, is the list of the only acts
    of aspects that happen, ``exactly=[{aspect: ..., at: ..., token: ...}]``.  ``types`` are your own actor and aspect
    classes, which the model may name besides the installed ones. ``max_actors`` is the limit for actors and composites,
    and a fifth of the limit for connections.  Of a ``partial`` model, inputs may be unconnected, to which a program
    will connect something; it is checked again before it runs.  ``Model.warnings`` holds what is odd but not wrong.
    """
    if unknown := changes.keys() - ModelChanges.__annotations__.keys():
        raise TypeError(f"load_model() got an unexpected keyword argument {min(unknown)!r}")
    loading = Loading()
    loading.passes(name, changes)
    loading.problems.raise_if_any()
    assert loading.model is not None, "what cannot be made is a problem"
    return loading.model


@dataclass
class Loading:
    """What the passes have made of a file so far, and the problems that they have found.

    The model is valid only if there are none.  A pass that cannot continue raises them as a ``ModelError``.
    """

    problems: Problems = field(default_factory=Problems)
    text: ModelText | None = None
    known: PartTypes | None = None
    model: Model | None = None

    def passes(self, name: str | Path, changes: ModelChanges) -> None:
        """Read, change and check a model."""
        problems, types = self.problems, list(changes.get("types", ()))
        limits = Limits(changes.get("max_actors", NORMAL.actors))
        partial = changes.get("partial", False)
        aspects, without_aspects = list(changes.get("aspects", ())), list(changes.get("without_aspects", ()))
        with problems.looking_for(OUTSIDE):
            files = _several(changes.get("overrides", ()))
            settings = [each for file in files for each in read_overrides(Path(file), problems)]
            settings += settings_of(changes.get("set", ()), problems)
        given = list(settings)
        with without_collection(), noting() as noted:
            # What the files declare.
            text, declared = read_model(str(name), problems)
            self.text = text
            catalogue = installed().with_types(types)
            with problems.looking_for(OUTSIDE):
                disturbances = load_disturbances(map(str, _several(changes.get("disturb", ()))), problems)
                for disturbance in disturbances:
                    declared = joined(declared, disturbance.composites, COMPOSITE_THERE, problems)
            with problems.looking_for(CLASS):
                around = Surroundings(inherit(declared, catalogue.actors, problems, limits), catalogue, problems)
                composites = around.composites
                text = settled = around.model(text)
                check_usage(text, declared, composites, catalogue.actors, problems)
            # What is changed from outside; settings of disturbances come first, because the last one wins.
            with problems.looking_for(OUTSIDE):
                text, set_by_them = add_disturbances(text, disturbances, problems)
                text, settings = only_acts(text, set_by_them + settings, problems)
                for change in without_aspects:
                    text = without(text, change, problems)
                for change in aspects:
                    text = change_aspect(text, change, problems)
                if text is not settled:  # something has come from outside
                    text = around.model(text)
            # What results.
            self.text, self.known = text, PartTypes(composites, catalogue)
            resolver = ParameterResolver(problems, Settings(settings, limits))
            self.model = Model(text.root.name, doc=text.root.doc)
            with problems.looking_for(VALUE):
                build(text, self.known, resolver, limits, self.model, partial=partial)
            if self.model.figures:
                with problems.looking_for(FIGURE):
                    figures_of(self.model, problems)
            self.model.warnings = problems.warnings
            self.model.is_checked = not (problems.found or partial)
            said = [*map("without {}".format, without_aspects), *aspects]
            self.model.origin = Origin(noted, given, said, types)


def build(
    text: ModelText,
    known: PartTypes,
    resolver: ParameterResolver,
    limits: Limits,
    model: Model,
    *,
    partial: bool = False,
) -> None:
    """Make the model that declarations describe, in passes; it is valid only if there are no problems afterwards."""
    problems, root = resolver.problems, text.root
    # Without a composite, nothing needs the types of all packages.
    for name in sorted(known.composites.keys() & known.catalogue.actors.keys() if known.composites else ()):
        composite = known.composites[name]
        at = composite.position if composite else None
        # Not an error: a model stays valid when a later version adds an actor with that name.
        message = f"composite {name!r} hides the actor type with the same name"
        problems.warn(message, at, "rename it if you need both", kind=ODD)
    resolver.of_model = root.parameters
    names = resolver.parameters("", root, {}, {}, None)
    made = Instantiator(known, resolver, ModelGraph(limits))
    made.dialect(root, names)
    try:
        made.body("", root, names)
    except TooLargeError:
        pass
    else:
        woven = weave_all(made)
        resolver.check_unused(made.graph)
        check(made.graph, problems, partial=partial)
        with problems.looking_for(ASPECT):
            check_processors(woven, problems)
            acts = None if text.exactly is None else acts_of(text.exactly, woven, problems)
        model.adopt(made.graph, woven, acts)
        with problems.looking_for(OUTPUT):
            model.output = OutputReader(made.graph, resolver).read(text, names)
        # Numbers without units are in the units that the model declares.
        model.parameters = {
            name: plain(value) if root.parameters[name].unit else counted_in_si(value) for name, value in names.items()
        }
        model.declared = dict(root.parameters)
        model.figures = _figures(text, resolver, names)
    try_classes(known, made.classes, resolver, limits)


def _figures(text: ModelText, values: Values, names: dict[str, object]) -> dict[str, DeclaredFigure]:
    """The type of each figure, its values, and the values as written."""
    found = {}
    for name, part in text.figures.items():
        local = Locals("", names)
        given = {key: values.of(entry.value, local, f"figure {name}.{key}") for key, entry in part.values.items()}
        if POISON not in given.values():
            in_si = {key: counted_in_si(value) for key, value in given.items()}
            found[name] = (part.type.text, in_si, MappingNode(part.values, part.type.position))
    return found


def _several(given: str | Path | Iterable[str | Path]) -> list[str | Path]:
    return [given] if isinstance(given, (str, Path)) else list(given)
