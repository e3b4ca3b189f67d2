"""A model under construction: what it consists of, its check, and changes whose arguments have been checked."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from epicycle.actors import Tag, paths

from ...support.collection import without_collection
from ..catalogue.code import code_of
from ..graph.acts import ActName
from ..graph.model_graph import ModelGraph
from ..graph.outputs import OutputSpec
from ..graph.ranks import firing_order
from ..graph.woven import WovenAspect, check_processors
from ..language.ports import ParameterText
from ..language.settings import Setting
from ..text.document import plain
from ..text.files import Noted
from ..text.problems import Position, Problem, Problems
from .checks import check
from .composite_aspect import check_nesting, detours
from .weave_all import arranged


@dataclass(frozen=True)
class Origin:
    """What a loaded model was made from: files, settings, changes of aspects, and the caller's own types.

    What was computed with it is not taken for what another one gives.
    """

    noted: Noted
    settings: Sequence[Setting]
    changes: Sequence[str]
    types: Sequence[type]
    spec: Any = None  # how it was named, if that is known
    state: Any = None  # what a program might have set since

    def facts(self) -> dict[str, Any]:
        """Everything that a run depends on beside its seed and Epicycle, as plain data without names of folders."""
        modules = dict.fromkeys(
            each.__module__ for each in self.types if each.__module__.partition(".")[0] != "epicycle"
        )
        files = (getattr(sys.modules.get(name), "__file__", None) for name in modules)
        code = code_of(Path(file) for file in files if file is not None)
        return {
            "files": sorted(_by_name([*self.noted.files.items(), *code.items()])),
            "packages": sorted(self.noted.packages.items()),
            "settings": [[each.path, plain(each.node)] for each in self.settings],
            "changes": list(self.changes),
            "types": sorted(f"{each.__module__}.{each.__qualname__}" for each in self.types),
        }


def _by_name(files: Iterable[tuple[str, str]]) -> set[tuple[str, str]]:
    return {(name.replace("\\", "/").rpartition("/")[2], digest) for name, digest in files}


class Building:
    """What a model consists of."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.graph = ModelGraph()  # all actors, composites, ports and connections
        self.parameters: dict[str, object] = {}
        self.declared: dict[str, ParameterText] = {}  # what its file declares of the parameters
        self.aspects: list[WovenAspect] = []
        self.exactly: frozenset[ActName] | None = None  # the only acts of aspects that happen
        self.output = OutputSpec()
        self.warnings: tuple[Problem, ...] = ()  # what is odd but not wrong
        self.is_checked = False  # since the last change
        self.origin: Origin | None = None  # what it was made from, if that is all there is to it
        self.scopes: dict[str, Any] = {}  # the composites that a program has asked for
        self._order: dict[str, int] | None = None  # worked out since then

    def local_tag(self, actor: str, tag: Tag) -> Tag:
        """A tag of the event log, as the actor or composite of that path sees it: in its director's time."""
        return self.graph.domain_of(actor).clock.tag(tag)

    def position_of(self, path: str) -> Position | None:
        """Where an actor, a composite, ``aspect NAME`` or ``stop_when`` is declared, if that is known."""
        if path == "stop_when":
            return self.output.stop_position
        woven = next((each for each in self.aspects if path == f"aspect {each.name}"), None)
        return self.graph.position_of(path) if woven is None else woven.position

    def check(self) -> None:
        """Check the model as a whole; raises ``ModelError`` with everything that is wrong.

        A ``Simulation`` does this first.
        """
        if not self.is_checked:
            problems = Problems()
            if check_nesting(self.aspects, self.graph, problems):
                self.edit().detours = detours(self.graph, self.aspects)
            check(self.graph, problems)
            check_processors(self.aspects, problems)
            problems.raise_if_any()
            self.warnings = problems.warnings
            self.is_checked = True
        self.graph.freeze()

    def order(self) -> dict[str, int]:
        """Engine: the firing order of a checked model; the same for all its runs."""
        if self._order is None:
            with without_collection():
                self._order = firing_order(self.graph)
        return self._order

    def edit(self) -> ModelGraph:
        """The graph, for changes: what was checked before may no longer hold."""
        if self.graph.is_frozen:
            self.graph = self.graph.copy()
        self.is_checked = False
        self.origin = None
        self._order = None
        return self.graph

    def adopt(
        self, graph: ModelGraph, aspects: Iterable[WovenAspect], exactly: frozenset[ActName] | None = None
    ) -> None:
        """Continue with a graph made from the present one, with further aspects, and only these acts of them."""
        self.graph = graph
        self.edit()
        self.enlist(aspects)
        if exactly is not None:
            self.exactly = (self.exactly or frozenset()) | exactly

    def enlist(self, aspects: Iterable[WovenAspect]) -> None:
        """Add these aspects to the model, with which it is to be checked again."""
        self.is_checked = False
        self.origin = None
        self.aspects = arranged([*self.aspects, *aspects], self.graph)

    def forget(self, path: str) -> None:
        """Remove an actor or composite, and everything that attaches to it or watches it."""
        self.edit().remove(path)
        self.aspects = [
            woven.without(path)
            for woven in self.aspects
            if not paths.is_within(woven.name, path) and not (woven.model and paths.is_within(woven.model.path, path))
        ]
        self.output = self.output.without(path)
