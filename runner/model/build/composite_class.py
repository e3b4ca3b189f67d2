"""Composite classes of YAML files, for models that are built in Python."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from epicycle.actors import did_you_mean

from ..catalogue.types import Catalogue, installed
from ..graph.model_graph import ModelGraph
from ..graph.woven import WovenAspect
from ..language.files import read_library
from ..language.inheritance import inherit
from ..language.models import CompositeText
from ..language.parts import PartText, beside
from ..language.settings import Settings
from ..language.surroundings import Surroundings
from ..text.problems import Position, Problems
from ..text.program import call_site, entries_of
from ..text.reading import Text
from .instantiate import Instantiator, PartTypes, TooLargeError
from .resolve import ParameterResolver
from .weave_all import weave_all


class CompositeClass:
    """A composite class; called with a name and values for its parameters, it returns what ``add`` takes."""

    def __init__(self, name: str, composites: dict[str, CompositeText], catalogue: Catalogue) -> None:
        self.name = name
        self.composites = composites
        self.catalogue = catalogue

    def __call__(self, path: str, **parameters: object) -> CompositeInstance:
        return CompositeInstance(self, path, parameters)

    def __repr__(self) -> str:
        return f"<composite class {self.name}({', '.join(self.composites[self.name].parameters)})>"


class CompositeInstance:
    """An instance that has not been added to a model yet."""

    def __init__(self, composite: CompositeClass, path: str, parameters: dict[str, object]) -> None:
        self.composite = composite
        self.path = path
        self.parameters = parameters

    def unfold(self, path: str, graph: ModelGraph, position: Position) -> tuple[ModelGraph, list[WovenAspect]]:
        """Its parts in a graph, with the aspects that come with it; raises ``ModelError``."""
        cls, problems = self.composite, Problems()
        part = PartText(self.path, position, Text(cls.name, position), entries_of(self.parameters, position))
        if "priority" in part.values:  # which is given like a parameter, as in a model file
            part = replace(part, priority=beside("priority", part.values.pop("priority").value))
        resolver = ParameterResolver(problems, Settings(limits=graph.limits))
        inside = graph.part(graph.director_of(path))
        made = Instantiator(PartTypes(cls.composites, cls.catalogue), resolver, inside)
        _, bracket, index = path.rpartition("[")
        names: dict[str, object] = {"index": int(index.rstrip("]"))} if bracket and path.endswith("]") else {}
        aspects: list[WovenAspect] = []
        with suppress(TooLargeError):
            made.instances(path, part, names)
            aspects = weave_all(made)
        problems.raise_if_any()
        return made.graph, aspects

    def __repr__(self) -> str:
        return f"<{self.composite.name} {self.path}>"


def load_composite(file: str | Path, name: str, *, types: Iterable[type] = ()) -> CompositeClass:
    """Read a composite class from a YAML file (or a packaged one such as ``robots/mobile_robot.yaml``).

    ``types`` are actor and aspect classes of your own that it may name.  Raises ``ModelError``.

    >>> MobileRobot = load_composite("robots/mobile_robot.yaml", "MobileRobot")
    >>> main = model.add(MobileRobot("main", start=[30, 0], objective=ReachGoal(goal=[0, 0]), max_speed="8 m/s"))
    """
    problems = Problems()
    declared = read_library(file, problems)
    catalogue = installed().with_types(types)
    composites = Surroundings(inherit(declared, catalogue.actors, problems), catalogue, problems).composites
    if name not in composites:
        hint = f"its composites: {', '.join(composites) or 'none'}"
        problems.add(f"{file} has no composite {name!r}{did_you_mean(name, list(composites))}", call_site(), hint)
    problems.raise_if_any()
    return CompositeClass(name, {key: each for key, each in composites.items() if each}, catalogue)
