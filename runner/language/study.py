"""What a study file says: read with positions, all that is misshapen told at once."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from ..catalogue import find, is_path, packaged_disturbances, packaged_models, packaged_studies, unreadable
from ..text import (
    MAX_SEED,
    Entry,
    Mapping,
    Node,
    NodeReader,
    Position,
    Problems,
    Scalar,
    did_you_mean,
    is_empty,
    parse,
    read,
)
from .declarations import STUDY_KEYS, STUDY_METRIC_KEYS, UNTIL_KEYS, DeclarationReader, PartText
from .dimensions import Dimension, Level, Listed
from .disturbance import find_disturbance
from .questions import QuestionReader, Questions, without
from .settings import Setting, parse_setting, settings_in
from .study_metric import StudyMetric, checked_metric
from .variation import DimensionReader

LARGE = 10_000_000  # bytes of a file
MAX_REPLICATIONS = 10**9
MAX_STUDY_SEED = MAX_SEED - MAX_REPLICATIONS
RESERVED = ("run", "condition", "replication", "seed", "status", "events", "digest", "error", "wall_time", "replay")


@dataclass
class Until:
    """Replications go on, ``batch`` by batch, until the 95 % interval of a metric's mean is narrow enough."""

    metric: str
    half_width: float
    batch: int
    at_most: int
    position: Position


@dataclass
class Study:
    """A model, the conditions under which it is run, and what is kept of each run; as its file says, not yet tried."""

    name: str
    path: Path
    text: str
    model: str  # a path, or the name of a packaged model
    doc: str = ""
    fixed: list[Setting] = field(default_factory=list)
    dimensions: list[Dimension] = field(default_factory=list)
    replications: int = 1
    seed: int = 0
    paired: bool = True
    until: Until | None = None
    metrics: list[StudyMetric] | None = None  # None: all of the model
    figures: dict[str, PartText] | None = None  # None: those that suit the table
    questions: Questions = field(default_factory=Questions)
    changes: tuple[str, ...] = ()  # --set, as given
    types: tuple[Path, ...] = ()

    @property
    def factors(self) -> dict[str, str]:
        """The columns of the table that say what was varied, and what they hold."""
        return {name: kind for dimension in self.dimensions for name, kind in dimension.columns.items()}


def find_study(name: str, problems: Problems) -> Path | None:
    """The file of a study: a path if it looks like one, otherwise a packaged study's name."""
    return find(name, "study", packaged_studies, problems)


def is_study(path: Path) -> bool:
    """Whether a file says that it is a study."""
    with suppress(OSError):
        # A large model need not be read twice; what is no file, or too large, is told when it is read.
        if path.is_file() and path.stat().st_size <= LARGE and b"study" not in path.read_bytes():
            return False
    node = read(path, Problems())
    return isinstance(node, Mapping) and "study" in node.entries


def read_study(
    name: str | Path,
    *,
    set: Iterable[str] = (),
    types: Iterable[Path] = (),
    replications: int | None = None,
    seed: int | None = None,
) -> Study:
    """The study of a file; raises ``ModelError`` with all that is wrong with what it says."""
    problems = Problems()
    path = find_study(str(name), problems)
    node = None if path is None else read(path, problems)
    problems.raise_if_any()
    assert path is not None
    assert node is not None
    text = path.read_text(encoding="utf-8")
    return _made(node, _StudyReader(problems, path), text, tuple(set), tuple(types), replications, seed)


def study_of_text(
    text: str,
    path: Path,
    set: Iterable[str] = (),
    types: Iterable[Path] = (),
    replications: int | None = None,
    seed: int | None = None,
    lender: tuple[str, str] | None = None,
) -> Study:
    """The study that a text says, which once was read from ``path``; the files that it names may be gone.

    ``lender``: file and text of the study that its claims are from.
    """
    problems = Problems()
    node = parse(text, str(path), problems)
    if node is None:
        problems.raise_if_any()
        raise AssertionError("a text that cannot be read is a problem")
    reader = _StudyReader(problems, path, lender, asks_for_files=False)
    return _made(node, reader, text, tuple(set), tuple(types), replications, seed)


def _made(
    node: Node,
    reader: _StudyReader,
    text: str,
    changes: tuple[str, ...],
    types: tuple[Path, ...],
    replications: int | None,
    seed: int | None,
) -> Study:
    problems = reader.problems
    study = reader.study(node, text)
    problems.raise_if_any()
    assert study is not None, "what is no study is a problem"
    if replications is not None:
        study.replications = replications
    if seed is not None:
        study.seed = seed
    study.changes, study.types = changes, types
    for change in changes:
        setting = parse_setting(change, problems)
        if setting is None:
            continue
        if setting.path in study.factors:
            problems.add(f"--set {change}: {setting.path} is what the study varies", None, "change it in the study")
        study.fixed.append(setting)
    problems.raise_if_any()
    return study


class _StudyReader(NodeReader):
    """Reads one study file; whatever is misshapen is added to ``problems`` and left out."""

    def __init__(
        self,
        problems: Problems,
        path: Path,
        lender: tuple[str, str] | None = None,
        *,
        asks_for_files: bool = True,
    ) -> None:
        super().__init__(problems)
        self.path = path
        self.asks_for_files = asks_for_files  # whether what is named has to be there
        self.lender = lender  # file and text of the study whose claims are judged here, if they are known

    def study(self, node: Node, text: str) -> Study | None:
        """The whole file."""
        if (
            isinstance(node, Mapping)
            and "study" not in node.entries
            and node.entries.keys() & {"actors", "disturbance"}
        ):
            self.problems.add(
                f"{self.path} is no study", node.position, "a study begins with a line like 'study: my_study'"
            )
            return None
        entries = self.entries(node, "the study", STUDY_KEYS)
        if entries is None:
            return None
        study = Study("study", self.path, text, "")
        for key, example in (("study", "study: my_study"), ("model", "model: mm1")):
            if key not in entries:
                self.problems.add(
                    "the study has no name" if key == "study" else "the study does not say which model it runs",
                    node.position,
                    f"add a line like '{example}'",
                )
        if "study" in entries:
            study.name = self.name(entries["study"].value, "the study's name") or study.name
        if "model" in entries:
            study.model = self.model(entries["model"].value)
        if "doc" in entries:
            study.doc = self.text(entries["doc"].value, "doc") or ""
        if "set" in entries and isinstance(entries["set"].value, Mapping):
            study.fixed = settings_in(entries["set"].value, self.problems)
        elif "set" in entries and not is_empty(entries["set"].value):
            self.problems.add(
                "set is not a mapping from parameters to values",
                entries["set"].value.position,
                "write lines like 'observer[*].sensor.range: 5 m'",
            )
        study.replications = self.number(entries, "replications", int, 1, 1, MAX_REPLICATIONS)
        study.seed = self.number(entries, "seed", int, 0, 0, MAX_STUDY_SEED)
        study.paired = self.flag(entries, "paired", True)
        if "vary" in entries:
            study.dimensions = DimensionReader(self.problems).vary(entries["vary"].value)
        if "disturb" in entries:
            study.dimensions += self.disturb(entries["disturb"])
        if "metrics" in entries:
            study.metrics = self.metrics(entries["metrics"].value)
        if "until" in entries:
            study.until = self.until(entries["until"].value, study)
        if "figures" in entries:
            reader = DeclarationReader(self.problems)
            parts = (reader.part(name, entry, "figure") for name, entry in self.named(entries, "figures"))
            study.figures = {part.name: part for part in parts if part is not None}
        before = len(self.problems)
        self.columns(study)
        if len(self.problems) == before:
            study.questions = QuestionReader(self.problems, study, self.factors_of).questions(entries, self.lender)
        return study

    def factors_of(self, node: Node, path: Path, problems: Problems) -> dict[str, str]:
        """What another study varies, whose claims this one judges."""
        reader = _StudyReader(problems, path, asks_for_files=self.asks_for_files)
        found = reader.study(without(node, "claims", "guideline"), "")
        return {} if found is None else found.factors

    # -- values ---------------------------------------------------------------------------------------------------

    def flag(self, entries: dict[str, Entry], key: str, default: bool) -> bool:
        """True or false."""
        if key not in entries:
            return default
        node = entries[key].value
        if isinstance(node, Scalar) and isinstance(node.value, bool):
            return node.value
        self.problems.add(f"{key} is neither true nor false", node.position)
        return default

    def model(self, node: Node) -> str:
        """A packaged model's name, or a file's name as seen from the study's folder."""
        name = self.text(node, "the model") or ""
        if is_path(name):
            file = self.path.parent / name
            reason = unreadable(file) if self.asks_for_files else ""
            if reason is None:
                beside = [each.name for each in file.parent.glob("*.yaml")] if file.parent.is_dir() else []
                self.problems.add(f"there is no file {name!r}{did_you_mean(file.name, beside)}", node.position)
            elif reason:
                self.problems.add(f"the model {name!r} {reason}", node.position)
            return str(file)
        if self.asks_for_files and name not in packaged_models():
            known = list(packaged_models())
            self.problems.add(
                f"there is no packaged model {name!r}{did_you_mean(name, known)}",
                node.position,
                f"packaged models: {', '.join(known)}; a path to a file ends in .yaml",
            )
        return name

    def disturb(self, entry: Entry) -> list[Dimension]:
        """Variants by name, ``{none: [], wifi: wifi_burst}``, or a list in which each is a variant of its own."""
        node = entry.value
        if isinstance(node, Mapping):
            variants = {name: self.texts(each.value, "a disturbance") for name, each in node.entries.items()}
        else:
            texts = self.texts(node, "disturb")
            variants = {Path(text.text).stem: [text] for text in texts}
        levels = []
        for variant, texts in variants.items():
            names = []
            for text in texts:
                name = str(self.path.parent / text.text) if is_path(text.text) else text.text
                found = Problems()
                file = find_disturbance(name, found)
                reason = unreadable(file) if self.asks_for_files else ""
                if reason:
                    self.problems.add(f"the disturbance {text.text!r} {reason}", text.position)
                elif reason is None:
                    known = list(packaged_disturbances())
                    self.problems.add(
                        f"there is no disturbance {text.text!r}{did_you_mean(text.text, known)}",
                        text.position,
                        f"packaged disturbances: {', '.join(known)}; a path to a file ends in .yaml",
                    )
                names.append(name)
            levels.append(Level((), {"disturb": variant}, tuple(names)))
        return [Listed("disturb", entry.key.position, {"disturb": "text"}, levels)] if levels else []

    # -- what is kept ---------------------------------------------------------------------------------------------

    def metrics(self, node: Node) -> list[StudyMetric]:
        """A list of names, or a mapping from names to expressions."""
        found = []
        if isinstance(node, Mapping):
            for name, entry in self.named({"metrics": Entry(Scalar("", "", True, node.position), node)}, "metrics"):
                if (metric := self.metric(name, entry)) is not None:
                    found.append(metric)
            return found
        for item in self.items(node, "metrics") or ():
            metric_name = self.name(item, "the metric")
            if metric_name is None or not isinstance(item, Scalar):
                continue
            if (metric := checked_metric(metric_name, item, self.problems)) is not None:
                found.append(metric)
        return found

    def metric(self, name: str, entry: Entry) -> StudyMetric | None:
        """An expression, or ``{value: expression, unit: s, to: min, doc: ...}``."""
        if isinstance(entry.value, Scalar):
            return checked_metric(name, entry.value, self.problems)
        if not isinstance(entry.value, Mapping):
            self.problems.add(f"metric {name!r} is not an expression", entry.value.position)
            return None
        inner = self.entries(entry.value, f"metric {name!r}", STUDY_METRIC_KEYS) or {}
        if "value" not in inner or is_empty(inner["value"].value):
            self.problems.add(f"metric {name!r} has no value", entry.key.position, "add 'value: ...', an expression")
            return None
        value = inner.pop("value").value
        said = {key: text for key, each in inner.items() if (text := self.text(each.value, key)) is not None}
        places = {key: each.value.position for key, each in inner.items()}
        if not isinstance(value, Scalar):
            self.problems.add(f"metric {name!r} is not an expression", value.position)
            return None
        return checked_metric(name, value, self.problems, said, places)

    def until(self, node: Node, study: Study) -> Until | None:
        """``{metric: mean_wait, half_width: 0.1, batch: 10, at_most: 1000}``."""
        entries = self.entries(node, "until", UNTIL_KEYS) or {}
        for key in ("metric", "half_width"):
            if key not in entries:
                self.problems.add(
                    f"until has no {key!r}", node.position, "write {metric: mean_wait, half_width: 0.1, at_most: 1000}"
                )
        if not {"metric", "half_width"} <= entries.keys():
            return None
        metric = self.text(entries["metric"].value, "metric") or ""
        half_width = self.number(entries, "half_width", float, 1.0, 0.0, None)
        batch = self.number(entries, "batch", int, 10, 2, MAX_REPLICATIONS)
        at_most = self.number(entries, "at_most", int, max(1000, batch), batch, MAX_REPLICATIONS)
        return Until(metric, half_width, batch, at_most, entries["metric"].value.position)

    def columns(self, study: Study) -> None:
        """Every column of the table has a name of its own."""
        seen: dict[str, Position] = {}
        for dimension in study.dimensions:
            for name in dimension.columns:
                if name in RESERVED or name in seen:
                    reason = "the table has a column of that name" if name in RESERVED else "it is varied twice"
                    self.problems.add(f"{name!r} cannot be varied: {reason}", dimension.position)
                seen[name] = dimension.position
        for metric in study.metrics or ():
            assert metric.node is not None
            if metric.name in RESERVED or metric.name in seen:
                self.problems.add(
                    f"a metric cannot be called {metric.name!r}: the table has such a column already",
                    metric.node.position,
                    "give it another name: metrics: {name: expression}",
                )
            seen[metric.name] = metric.node.position
