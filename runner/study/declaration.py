"""What a study file says: read with positions, all that is misshapen told at once."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path
from typing import Any

from epicycle.actors import Parameter, ParameterError, UnitError, parse_unit

from ..model import Position, Problems, did_you_mean
from ..model.declarations import HYPERCUBE_KEYS, RANGE_KEYS, STUDY_KEYS, UNTIL_KEYS, DeclarationReader, PartText
from ..model.disturbance import find_disturbance
from ..model.document import Entry, Mapping, Node, Scalar, Sequence, parse, read
from ..model.observation import MAX_SEED
from ..model.packaged import find, is_path, packaged_disturbances, packaged_models, packaged_studies
from ..model.reading import NodeReader
from ..model.settings import Setting, is_pattern, parse_setting, settings_in
from .dimensions import Dimension, Level, Listed, Ranged, as_factor, in_si, kind_of, number_node, split_number
from .metrics import StudyMetric, checked_metric
from .questions import QuestionReader, Questions, without

LARGE = 10_000_000  # bytes of a file
MAX_REPLICATIONS = 10**9
MAX_LEVELS = 10**12  # of a range
MAX_SAMPLES = 100_000  # of a Latin hypercube, which is made as a whole
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
    name: str | Path, *, set: Iterable[str] = (), types: Iterable[Path] = (), replications: int | None = None
) -> Study:
    """The study of a file; raises ``ModelError`` with all that is wrong with what it says."""
    problems = Problems()
    path = find_study(str(name), problems)
    node = None if path is None else read(path, problems)
    problems.raise_if_any()
    assert path is not None
    assert node is not None
    text = path.read_text(encoding="utf-8")
    return _made(node, _StudyReader(problems, path), text, tuple(set), tuple(types), replications)


def study_of_text(
    text: str,
    path: Path,
    set: Iterable[str] = (),
    types: Iterable[Path] = (),
    replications: int | None = None,
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
    return _made(node, reader, text, tuple(set), tuple(types), replications)


def _made(
    node: Node,
    reader: _StudyReader,
    text: str,
    changes: tuple[str, ...],
    types: tuple[Path, ...],
    replications: int | None,
) -> Study:
    problems = reader.problems
    study = reader.study(node, text)
    problems.raise_if_any()
    assert study is not None, "what is no study is a problem"
    if replications is not None:
        study.replications = replications
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
        elif "set" in entries and not _is_empty(entries["set"].value):
            self.problems.add(
                "set is not a mapping from parameters to values",
                entries["set"].value.position,
                "write lines like 'observer[*].sensor.range: 5 m'",
            )
        study.replications = self.number(entries, "replications", int, 1, 1, MAX_REPLICATIONS)
        study.seed = self.number(entries, "seed", int, 0, 0, MAX_SEED - MAX_REPLICATIONS)
        study.paired = self.flag(entries, "paired", True)
        if "vary" in entries:
            study.dimensions = self.vary(entries["vary"].value)
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

    def number(self, entries: dict[str, Entry], key: str, kind: Any, default: Any, low: Any, high: Any) -> Any:
        """A number within bounds."""
        if key not in entries:
            return default
        node = entries[key].value
        try:
            return Parameter(kind, min=low, max=high).convert(node.value if isinstance(node, Scalar) else "a list")
        except ParameterError as error:
            self.problems.add(f"{key}: {error}", node.position)
            return default

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
            if self.asks_for_files and not file.is_file():
                beside = [each.name for each in file.parent.glob("*.yaml")] if file.parent.is_dir() else []
                self.problems.add(f"there is no file {name!r}{did_you_mean(file.name, beside)}", node.position)
            return str(file)
        if self.asks_for_files and name not in packaged_models():
            known = list(packaged_models())
            self.problems.add(
                f"there is no packaged model {name!r}{did_you_mean(name, known)}",
                node.position,
                f"packaged models: {', '.join(known)}; a path to a file ends in .yaml",
            )
        return name

    # -- dimensions -----------------------------------------------------------------------------------------------

    def vary(self, node: Node) -> list[Dimension]:
        """An ordered mapping of dimensions."""
        if _is_empty(node):
            return []
        if not isinstance(node, Mapping):
            self.problems.add("vary is not a mapping", node.position, "write lines like 'load: [0.5, 0.75, 0.9]'")
            return []
        found = (self.dimension(name, entry) for name, entry in node.entries.items())
        return [dimension for dimension in found if dimension is not None]

    def dimension(self, name: str, entry: Entry) -> Dimension | None:
        """A list, a range, or a mapping with the key zip, cases or latin_hypercube."""
        node, position = entry.value, entry.key.position
        if isinstance(node, Sequence):
            return self.listed(name, position, {name: Entry(entry.key, node)})
        if isinstance(node, Mapping):
            keys = node.entries.keys()
            for form, reader in (("zip", self.zipped), ("cases", self.cases), ("latin_hypercube", self.hypercube)):
                if form in keys and len(keys) == 1:
                    return reader(name, position, node.entries[form].value)
            if keys & set(RANGE_KEYS):
                return self.ranged(name, position, node)
        self.problems.add(
            f"{name!r} does not say what values it takes",
            node.position,
            "write a list, {from, to, step}, {zip: ...}, {cases: ...} or {latin_hypercube: ...}",
        )
        return None

    def listed(self, name: str, position: Position, lists: dict[str, Entry]) -> Dimension | None:
        """One list for each path, all of one length."""
        before = len(self.problems)
        items = {path: entry.value.items for path, entry in lists.items() if isinstance(entry.value, Sequence)}
        keys = {path: entry.key.position for path, entry in lists.items()}
        for path, key in keys.items():
            is_pattern(path, key, self.problems)
        sizes = {len(each) for each in items.values()}
        if 0 in sizes:
            self.problems.add(f"{name!r} takes no value at all", position, "give at least one")
        elif len(sizes) > 1:
            shown = ", ".join(f"{path}: {len(each)}" for path, each in items.items())
            self.problems.add(f"the lists of {name!r} differ in length", position, shown)
        if len(self.problems) > before:
            return None
        kinds = {path: kind_of(each) for path, each in items.items()}
        levels: list[Level] = []
        seen: dict[str, Node] = {}
        for nodes in zip(*items.values(), strict=True):
            pairs = list(zip(items, nodes, strict=True))
            values = {path: as_factor(node, kinds[path]) for path, node in pairs}
            if (first := seen.setdefault(repr(values), nodes[0])) is not nodes[0]:
                at = first.position
                self.problems.add(
                    f"{name!r} takes the same value twice",
                    nodes[0].position,
                    f"first at {at.file}:{at.line}:{at.column}",
                )
            levels.append(Level(tuple(Setting(path, node, keys[path]) for path, node in pairs), values))
        return Listed(name, position, kinds, levels)

    def zipped(self, name: str, position: Position, node: Node) -> Dimension | None:
        """Parameters that go together: the first values of all lists, the second ones, and so on."""
        if not isinstance(node, Mapping) or not node.entries:
            self.problems.add(f"zip of {name!r} is not a mapping from parameters to lists", node.position)
            return None
        before = len(self.problems)
        for path, entry in node.entries.items():
            if not isinstance(entry.value, Sequence):
                self.problems.add(f"{path!r} is not a list", entry.value.position, "begin each entry with '- '")
        return self.listed(name, position, node.entries) if len(self.problems) == before else None

    def cases(self, name: str, position: Position, node: Node) -> Dimension | None:
        """Named sets of values; the column holds the names."""
        if not isinstance(node, Mapping) or not node.entries:
            self.problems.add(f"cases of {name!r} is not a mapping from names to settings", node.position)
            return None
        levels = []
        for case, entry in node.entries.items():
            settings: list[Setting] = []
            if isinstance(entry.value, Mapping):
                settings = settings_in(entry.value, self.problems)
            elif not _is_empty(entry.value):
                self.problems.add(f"case {case!r} is not a mapping from parameters to values", entry.value.position)
            levels.append(Level(tuple(settings), {name: case}))
        return Listed(name, position, {name: "text"}, levels)

    def ranged(self, name: str, position: Position, node: Mapping) -> Dimension | None:
        """``{from: 0, to: 0.5, step: 0.1}``; the end counts if a step falls on it."""
        before = len(self.problems)
        is_pattern(name, position, self.problems)
        entries = self.entries(node, f"the range of {name!r}", RANGE_KEYS) or {}
        numbers: dict[str, Decimal] = {}
        units: dict[str, None] = {}
        for key in RANGE_KEYS:
            if key not in entries:
                self.problems.add(f"the range of {name!r} has no {key!r}", node.position)
            elif (number := self.quantity(entries[key].value, f"{key} of {name!r}")) is not None:
                numbers[key] = number[0]
                units[number[1]] = None
        if len(self.problems) > before:
            return None
        start, end, step = (numbers[key] for key in RANGE_KEYS)
        at = entries["step"].value.position
        if len(units) > 1:
            self.problems.add(f"the range of {name!r} has more than one unit", node.position, "write the same for all")
            return None
        if step == 0 or (end - start) / step < 0:
            self.problems.add(f"the range of {name!r} never gets from {start} to {end} in steps of {step}", at)
            return None
        size = int((end - start) / step) + 1
        if size > MAX_LEVELS:
            self.problems.add(f"the range of {name!r} has more than {MAX_LEVELS:,} values", at)
            return None
        return Ranged(name, position, start, step, size, next(iter(units)), node.position)

    def quantity(self, node: Node, what: str) -> tuple[Decimal, str] | None:
        """A number, perhaps with a unit."""
        found = split_number(node)
        if found is None:
            self.problems.add(f"{what} is not a number", node.position, "write 5, 0.1 or '5 m'")
            return None
        try:
            if found[1]:
                parse_unit(found[1])
        except UnitError as error:
            self.problems.add(f"{what}: {error}", node.position)
            return None
        return found

    def hypercube(self, name: str, position: Position, node: Node) -> Dimension | None:
        """Points that fill a box evenly: of ``size`` slices of each range, each is met by one point."""
        before = len(self.problems)
        entries = self.entries(node, f"latin_hypercube of {name!r}", HYPERCUBE_KEYS) or {}
        if "size" not in entries or "ranges" not in entries:
            self.problems.add(
                f"latin_hypercube of {name!r} needs 'size' and 'ranges'",
                position,
                "write {size: 20, seed: 1, ranges: {load: [0.1, 0.9]}}",
            )
            return None
        size = self.number(entries, "size", int, 1, 1, MAX_SAMPLES)
        seed = self.number(entries, "seed", int, 0, 0, MAX_SEED)
        box = entries["ranges"].value
        if not isinstance(box, Mapping) or not box.entries:
            self.problems.add(f"ranges of {name!r} is not a mapping from parameters to [low, high]", box.position)
            return None
        bounds: dict[str, tuple[float, float, str, Position]] = {}
        for path, entry in box.entries.items():
            is_pattern(path, entry.key.position, self.problems)
            items = entry.value.items if isinstance(entry.value, Sequence) else ()
            ends = [end for item in items if (end := self.quantity(item, f"a bound of {path!r}")) is not None]
            if len(items) == 2 and len(ends) < 2:
                continue  # which has been told
            if len(ends) != 2 or ends[0][1] != ends[1][1] or not ends[0][0] < ends[1][0]:
                self.problems.add(f"{path!r} is not [low, high] in one unit", entry.value.position)
            else:
                bounds[path] = float(ends[0][0]), float(ends[1][0]), ends[0][1], entry.key.position
        if len(self.problems) > before:
            return None
        import numpy as np
        from scipy.stats import qmc

        points = qmc.LatinHypercube(d=len(bounds), seed=np.random.default_rng(seed)).random(size)
        levels = []
        for point in points:
            settings, values = [], {}
            for (path, (low, high, unit, at)), share in zip(bounds.items(), point, strict=True):
                value = float(low + share * (high - low))
                settings.append(Setting(path, number_node(value, unit, at), at))
                values[path] = in_si(value, unit)
            levels.append(Level(tuple(settings), dict(values)))
        return Listed(name, position, dict.fromkeys(bounds, "float"), levels)

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
                if self.asks_for_files and (file is None or not file.is_file()):
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
                if not isinstance(entry.value, Scalar):
                    self.problems.add(f"metric {name!r} is not an expression", entry.value.position)
                elif metric := checked_metric(name, entry.value.text, entry.value, self.problems):
                    found.append(metric)
            return found
        for item in self.items(node, "metrics") or ():
            metric_name = self.name(item, "the metric")
            if metric_name is None or not isinstance(item, Scalar):
                continue
            if (metric := checked_metric(metric_name, metric_name, item, self.problems)) is not None:
                found.append(metric)
        return found

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


def _is_empty(node: Node) -> bool:
    return isinstance(node, Scalar) and node.value is None
