"""Plan: the conditions of a study and the identity of every run, computed one at a time."""

from __future__ import annotations

import hashlib
import json
import logging
import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from math import prod
from pathlib import Path
from typing import Any, TypedDict

from epicycle.actors import EpicycleError, did_you_mean
from epicycle.actors.expression import ExpressionError

from ...model.build.load import load_model
from ...model.build.model import Model
from ...model.catalogue.code import code_of
from ...model.catalogue.packaged import is_path
from ...model.catalogue.types import types_of_file
from ...model.language.dimensions import Dimension, Factor, Level
from ...model.language.study import RESERVED, Study, study_of_text
from ...model.language.study_metric import StudyMetric
from ...model.text.document import plain
from ...model.text.files import Noted, noting
from ...model.text.kinds import OF_STUDY
from ...model.text.problems import ModelError, Problems
from ..provenance import version_of
from .columns import Column, check_metric, columns_of
from .seal import has_seal, seal

_LOGGER = logging.getLogger("epicycle")

MAX_TRIED = 20  # levels of a dimension that the model is loaded with before anything runs


class Search(TypedDict):
    """A search whose runs are in a folder: how many it makes at most, and its command, which continues it."""

    runs: int
    command: list[str]


Sources = dict[str, str]  # SHA-256 by the name of a file, and versions by 'package NAME'


def epicycle_version() -> str:
    """The version that made results: another one may give different ones."""
    return version_of("epicycle") or "unknown"


class CodeError(EpicycleError):
    """A results folder whose types are code that the user has not chosen to run."""


@dataclass(frozen=True)
class Condition:
    """One combination of levels; ``key`` identifies it in any study."""

    index: int
    level: Level  # over all dimensions
    key: str

    @property
    def values(self) -> dict[str, Factor]:
        """Its values in the columns of the table."""
        return self.level.values


@dataclass(frozen=True, eq=False)
class Plan:
    """A checked study: every level of every dimension loads.

    ``made`` checks it; ``of_manifest`` takes the outcome of that check from a results folder.
    """

    study: Study
    metrics: list[StudyMetric]
    sources: Sources
    extra: list[dict[int, Sources]]  # by dimension, the further files that single levels read
    texts: dict[str, str]  # the YAML of the model and of everything that belongs to it
    columns: dict[str, Column]
    made_with: str  # the version of Epicycle
    files: Mapping[str, str] = field(default_factory=dict)  # SHA-256 of all that was read, by the names used for that
    search: Search | None = None  # what chose the conditions, if they were not known from the start
    denied: str = ""  # why the code of its types must not be run

    @property
    def shares(self) -> frozenset[str]:
        """The metrics that are true or false in each run."""
        return frozenset(name for name, column in self.columns.items() if column.is_share)

    # -- making one -----------------------------------------------------------------------------------------------

    @classmethod
    def made(cls, study: Study) -> Plan:
        """Load the model with the first levels of all dimensions, and with each other level in the place of its first.

        Raises ``ModelError`` with all problems in any of them.
        """
        problems = Problems(OF_STUDY)
        read = _Read()
        firsts = [0] * len(study.dimensions)
        sources = _tried(study, firsts, read, problems)
        extra: list[dict[int, Sources]] = [{} for _ in study.dimensions]
        for number, dimension in enumerate(study.dimensions):
            few = min(dimension.size, MAX_TRIED)  # evenly spread
            for index in sorted({step * (dimension.size - 1) // (few - 1) for step in range(1, few)}):
                indices = [*firsts[:number], index, *firsts[number + 1 :]]
                found = _tried(study, indices, read, problems)
                if more := {name: digest for name, digest in found.items() if sources.get(name) != digest}:
                    extra[number][index] = more
        problems.raise_if_any()
        metrics = list(study.metrics or ())
        if study.metrics is None:
            metrics = [StudyMetric(metric.name, metric.name) for metric in read.models[0].output.metrics]
        for metric in metrics:
            check_metric(metric, read.models, problems)
            if study.metrics is None and (metric.name in RESERVED or metric.name in study.factors):
                problems.add(
                    f"the model's metric {metric.name!r} has the same name as another column of the table",
                    None,
                    f"rename it in the study: metrics: {{my_name: {metric.name}}}",
                )
        names = [metric.name for metric in metrics]
        if study.until is not None and (wanted := study.until.metric) not in names:
            problems.add(
                f"until: the study has no metric {wanted!r}{did_you_mean(wanted, names)}",
                study.until.position,
                f"its metrics: {', '.join(names) or 'none'}",
            )
        study.questions.check(names, problems)
        problems.raise_if_any()
        columns = columns_of(study.dimensions, metrics, read.models[0])
        if endless := read.models[0].endless:
            _LOGGER.warning(
                "warning: %s\n   help: set 'stop' in its section 'run'; --run-timeout ends runs that take too long",
                endless,
            )
        return cls(study, metrics, sources, extra, read.texts, columns, epicycle_version(), read.files)

    @classmethod
    def of_manifest(cls, manifest: Mapping[str, Any]) -> Plan:
        """The plan of a results folder; no file but the manifest is needed.

        Raises ``ModelError``, and ``EpicycleError`` if the manifest contradicts itself.
        """
        study = study_of_text(
            manifest["text"],
            Path(manifest["file"]),
            manifest["set"],
            map(Path, manifest["types"]),
            manifest["replications"],
            manifest["seed"],
            None if (lender := manifest.get("lender")) is None else (lender[0], lender[1]),
        )
        if changed := manifest.get("changed"):
            aspects, without = tuple(changed["aspects"]), tuple(changed["without"])
            study = replace(study, aspects=aspects, without_aspects=without, stop=changed["stop"])
        try:
            said = {(metric.name, metric.source): metric for metric in study.metrics or ()}
            metrics = [said.get(each) or StudyMetric(*each) for each in manifest["metrics"].items()]
            extra = [{int(index): found for index, found in each.items()} for each in manifest["level_sources"]]
        except (ValueError, ExpressionError) as error:
            raise EpicycleError(f"the manifest of {study.name} is damaged: {error}") from error
        said_metrics, names = manifest["metrics"], [metric.name for metric in metrics]
        declared = {each.name: each.source for each in study.metrics or ()} or {name: name for name in names}
        unlike = {
            "study": study.name != manifest["study"],
            "factors": study.factors != manifest["factors"],
            "metrics": list(said_metrics.items()) != list(declared.items())
            or bool(said_metrics.keys() & {*RESERVED, *study.factors})
            or (study.until is not None and study.until.metric not in names),
            "level_sources": len(extra) != len(study.dimensions),
        }
        if wrong := [name for name, is_wrong in unlike.items() if is_wrong]:
            found = ", ".join(map(repr, wrong))
            raise EpicycleError(f"the manifest of {study.name} is damaged: {found} does not match the study's text")
        problems = Problems(OF_STUDY)
        study.questions.check(names, problems)
        problems.raise_if_any()
        columns = {name: Column(**said) for name, said in manifest["columns"].items()}
        said_of = (manifest["sources"], extra, manifest["model"], columns, manifest["epicycle"])
        return cls(study, metrics, *said_of, search=manifest.get("search"), denied=_why_denied(manifest, study.model))

    def allowed(self, types: Iterable[Path] = ()) -> Plan:
        """The same with leave to run the code of its types, or of these files in their place."""
        return replace(self, study=replace(self.study, types=tuple(types) or self.study.types), denied="")

    def check_allowed(self) -> None:
        """Raise ``CodeError`` if loading the model would run code that the user has not chosen."""
        if self.denied:
            raise CodeError(self.denied)

    def manifest(self) -> dict[str, Any]:
        """The entries that ``of_manifest`` needs; raises ``CodeError``."""
        self.check_allowed()
        study = self.study
        code = code_of(study.types)
        return {
            "epicycle": self.made_with,
            "study": study.name,
            "file": str(study.path.resolve()),
            "text": study.text,
            "set": list(study.changes),
            "types": [str(path.resolve()) for path in study.types],
            "replications": study.replications,
            "seed": study.seed,
            "lender": study.questions.lender,
            "factors": study.factors,
            "metrics": {metric.name: metric.source for metric in self.metrics},
            "columns": {name: asdict(column) for name, column in self.columns.items()},
            "model": self.texts,
            "sources": self.sources,
            "level_sources": [{str(index): found for index, found in each.items()} for each in self.extra],
            **({} if self.search is None else {"search": self.search}),
            **({"code": code} if code else {}),
            "seal": seal(sealed(str(study.path.resolve()), study.text, code)),
            **({"changed": changed} if (changed := _changed(study)) else {}),
        }

    # -- what it holds --------------------------------------------------------------------------------------------

    @property
    def conditions(self) -> int:
        """How many conditions there are."""
        return prod(dimension.size for dimension in self.study.dimensions)

    @property
    def replications(self) -> int:
        """The greatest number of runs of a condition."""
        return self.study.replications if self.study.until is None else self.study.until.at_most

    @property
    def size(self) -> int:
        """The greatest number of runs."""
        return self.conditions * self.replications if self.search is None else self.search["runs"]

    @property
    def decides(self) -> str | None:
        """The metric that decides how many replications a condition gets, if any."""
        return None if self.study.until is None else self.study.until.metric

    def __iter__(self) -> Iterator[Condition]:
        return map(self.condition, range(self.conditions))

    def condition(self, index: int) -> Condition:
        """A condition by its number; the last dimension changes fastest."""
        place, rest = [0] * len(self.study.dimensions), index
        for number, dimension in reversed(list(enumerate(self.study.dimensions))):
            rest, place[number] = divmod(rest, dimension.size)
        level = _together(self.study, place)
        sources = dict(self.sources)
        for extra, at in zip(self.extra, place, strict=True):
            sources.update(extra.get(at, {}))
        watched = self.study.monitors
        identity = {
            "epicycle": self.made_with,
            "model": Path(self.study.model).name,
            "sources": sorted(sources.items()),
            "set": [[setting.path, plain(setting.node)] for setting in level.settings],
            "disturb": [Path(name).name for name in level.disturb],
            "metrics": [
                [metric.name, metric.source, *([metric.unit, metric.to] if metric.to else [])]
                for metric in self.metrics
            ],
            **({"monitors": [[name, text.text] for name, text in watched.items()]} if watched else {}),
            **({"changed": changed} if (changed := _changed(self.study)) else {}),
        }
        return Condition(index, level, _hash(identity))

    def find(self, key: str, values: Mapping[str, Factor]) -> int | None:
        """The number of the condition with this key and these values; None if the plan has none."""
        place = [at for each in self.study.dimensions if (at := each.find(values)) is not None]
        if len(place) < len(self.study.dimensions):
            return None
        index = index_of(place, self.study.dimensions)
        return index if self.condition(index).key == key else None

    def seed(self, condition: Condition, replication: int) -> int:
        """The same for all conditions if they are paired, otherwise one that depends on the condition, too."""
        if self.study.paired:
            return self.study.seed + replication
        return int(_hash([self.study.seed, condition.key, replication])[:15], 16)

    def key(self, condition: Condition, replication: int) -> str:
        """The identity of a run."""
        return _hash([condition.key, self.seed(condition, replication)])

    def unlike(self, noted: Noted) -> list[str]:
        """The files that were not read when the plan was checked, or have changed since."""
        known = [self.sources, *(found for each in self.extra for found in each.values())]
        digests = {digest for found in known for digest in found.values()}
        files = [name for name, digest in noted.files.items() if digest not in digests]
        packages = [(f"package {name}", version) for name, version in noted.packages.items()]
        return files + [name for name, version in packages if all(found.get(name) != version for found in known)]

    def load(self, condition: Condition) -> Model:
        """The model as it is in a condition; raises ``ModelError`` and ``CodeError``."""
        self.check_allowed()
        return _load(self.study, condition.level)


def _hash(value: object) -> str:
    text = json.dumps(value, ensure_ascii=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def index_of(place: Iterable[int], dimensions: Sequence[Dimension]) -> int:
    """The number of the condition with these levels."""
    found = 0
    for dimension, level in zip(dimensions, place, strict=True):
        found = found * dimension.size + level
    return found


def sealed(file: str, text: str, code: Mapping[str, str]) -> list[object]:
    """What a seal covers: whatever leads to files that loading the model reads or runs."""
    return [file, text, dict(code)]


def _why_denied(manifest: Mapping[str, Any], model: str) -> str:
    """Why the model that a manifest names must not be loaded; empty for what this user has run to make the folder."""
    types, code, file = manifest["types"], manifest.get("code", {}), manifest["file"]
    is_own = has_seal(sealed(file, manifest["text"], code), manifest.get("seal"))
    if not types:
        if is_own or not is_path(model):
            return ""
        return (
            f"the results were not made here by you, and loading their model would read {Path(file).parent / model}\n"
            f"   help: if you trust it, make the runs yourself: epicycle study {shlex.quote(file)} --out DIR"
        )
    option = " ".join(f"--types {shlex.quote(file)}" for file in types)
    told = f"\n   help: if you trust {'it' if len(types) == 1 else 'them'}, add {option}; in Python, types=[...]"
    if not (set(types) <= code.keys() and is_own):
        files = ", ".join(types)
        return f"the results were not made here by you, and loading their model would run the code of {files}{told}"
    try:
        now = code_of(map(Path, types))
    except EpicycleError as error:
        return f"the code of the results cannot be read: {error}{told}"
    if changed := sorted(name for name in now.keys() | code.keys() if now.get(name) != code.get(name)):
        return f"code has changed since the results were made, and is not run: {', '.join(changed)}{told}"
    return ""


def _together(study: Study, place: Iterable[int]) -> Level:
    """The settings of the study for all runs, and the levels of a condition."""
    levels = [dimension.level(at) for dimension, at in zip(study.dimensions, place, strict=True)]
    return Level(
        (*study.fixed, *(setting for level in levels for setting in level.settings)),
        {name: value for level in levels for name, value in level.values.items()},
        tuple(name for level in levels for name in level.disturb),
    )


def _changed(study: Study) -> dict[str, Any]:
    """What else is changed in all runs, if anything is."""
    if not (study.aspects or study.without_aspects or study.stop is not None):
        return {}
    return {"aspects": list(study.aspects), "without": list(study.without_aspects), "stop": study.stop}


def _load(study: Study, level: Level) -> Model:
    types = [each for file in study.types for each in types_of_file(file)]
    model = load_model(
        study.model,
        set=level.settings,
        disturb=level.disturb,
        aspects=study.aspects,
        without_aspects=study.without_aspects,
        types=types,
    )
    if study.stop is not None:
        model.stop = study.stop
    problems = Problems(OF_STUDY)
    for name, text in study.monitors.items():
        try:
            model.monitor(name, text.text)
        except ModelError as error:
            for problem in error.problems:
                problems.add(problem.message, text.position, *problem.help)
    problems.raise_if_any()
    return model


@dataclass
class _Read:
    """What checking a study has read."""

    models: list[Model] = field(default_factory=list)
    texts: dict[str, str] = field(default_factory=dict)
    files: dict[str, str] = field(default_factory=dict)


def _tried(study: Study, place: list[int], read: _Read, problems: Problems) -> Sources:
    """Load the model with these levels; returns the files that this reads."""
    with noting() as noted:
        try:
            read.models.append(_load(study, _together(study, place)))
        except ModelError as error:
            for problem in error.problems:
                problems.add(problem.message, problem.position, *problem.help)
    home = Path(next(iter(noted.files), "")).resolve().parent
    found = {f"package {name}": version for name, version in noted.packages.items()}
    for name, digest in [
        *noted.files.items(),
        *code_of(study.types).items(),
    ]:
        read.files[name] = digest
        path = Path(name).resolve()
        # By names that stay the same when the study with its model, or Epicycle, is moved.
        shown = path.relative_to(home).as_posix() if path.is_relative_to(home) else path.name
        for parent in path.parents:
            if found.get(shown, digest) == digest:
                break
            shown = f"{parent.name}/{shown}"  # of two files that have the same name
        found[shown] = digest
        if path.suffix in (".yaml", ".yml"):
            read.texts[shown] = path.read_text(encoding="utf-8")
    return found
