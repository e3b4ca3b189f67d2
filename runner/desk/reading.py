"""A text under work, read by the passes that load a model: what is wrong with it, and what is known of it so far."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

from epicycle.actors import EpicycleError

from ..model.build.load import Loading
from ..model.catalogue.packaged import is_path, packaged_models
from ..model.language.disturbance import load_disturbance
from ..model.language.files import read_library
from ..model.language.models import LIBRARY
from ..model.language.study import read_study
from ..model.text.document import Mapping as MappingNode
from ..model.text.document import Node, parse_once
from ..model.text.document import read as read_node
from ..model.text.files import opened
from ..model.text.kinds import FILE
from ..model.text.problems import ModelError, Problem, Problems
from ..support.collection import without_collection

Texts = Mapping[Path, str]
NO_TEXTS: Texts = MappingProxyType({})
Parsed = dict[str, tuple[str, Any]]  # the latest texts without problems, by their names in messages, and what they hold


@dataclass(frozen=True)
class Reading:
    """What is known of a file.

    ``problems`` are those that ``epicycle validate`` reports, with the warnings behind; ``more`` means that there are
    others.  ``files`` are the texts that it is made of, by their names in messages, with their paths.
    """

    path: Path
    problems: tuple[Problem, ...]
    more: bool
    loading: Loading
    files: Mapping[str, tuple[Path, str]]
    types: tuple[type, ...] = ()
    nodes: Mapping[str, Node] = field(default_factory=dict)
    parsed: Parsed = field(default_factory=dict)

    @property
    def is_valid(self) -> bool:
        return all(each.severity != "error" for each in self.problems)

    @property
    def name(self) -> str:
        """The file's name in messages."""
        return str(self.path)


def read(
    name: str | Path,
    texts: Texts = NO_TEXTS,
    types: Iterable[type] = (),
    *,
    parsed: Parsed | None = None,
    **changes: Any,
) -> Reading:
    """Read a model, a study, a disturbance, or a file of composite classes; never raises because of what it holds.

    ``texts`` are read in place of files, by their resolved paths; ``types`` are classes that the model may name, and
    ``changes`` those of ``load_model``.  What has not changed since it was ``parsed`` is not parsed again.
    """
    is_file = isinstance(name, Path) or is_path(name)
    path = Path(name) if is_file else packaged_models().get(str(name), Path(name))
    types, loading = tuple(types), Loading()
    given: Any = {**changes, "types": types}
    found, more = list[Problem](), False
    with opened(texts, parsed) as known, without_collection():
        try:
            if is_file:
                _passes(path, loading, given)
            else:
                loading.passes(name, given)
                loading.problems.raise_if_any()
        except ModelError as error:
            found, more = list(error.problems), error.more
        except EpicycleError as error:
            found = [Problem(str(error), kind=FILE)]
    nodes = {name: parse_once(text, name, Problems(), known) for name, (_, text) in known.read.items()}
    return Reading(
        path,
        (*found, *loading.problems.warnings),
        more,
        loading,
        known.read,
        types,
        {name: node for name, node in nodes.items() if node is not None},
        known.parsed,
    )


def _passes(path: Path, loading: Loading, changes: Any) -> None:
    """Raises what is wrong with the file as ``ModelError``."""
    node, problems = read_node(path, Problems()), loading.problems
    keys = node.entries.keys() if isinstance(node, MappingNode) else set[str]()
    if "study" in keys:
        read_study(path)
    elif "disturbance" in keys and "model" not in keys:
        load_disturbance(f"./{path}" if path.parent == Path() else str(path), problems)
    elif "composites" in keys and keys <= LIBRARY.keys.keys():
        read_library(path, problems)
    else:
        loading.passes(path, changes)
    problems.raise_if_any()
