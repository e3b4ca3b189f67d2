"""Study files: the keys of a study, and how they are read; everything malformed is reported at once."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

from epicycle.actors import did_you_mean

from ..catalogue.packaged import find, is_path, unreadable
from ..text.document import Entry, Mapping, Node, Scalar, parse, read
from ..text.files import opened_text
from ..text.kinds import OF_STUDY
from ..text.limits import MAX_SEED
from ..text.problems import POISON, Poison, Position, Problems
from ..text.reading import NodeReader, Text, is_empty
from .claims import Questions
from .dimensions import DIMENSIONS, Dimension, Level
from .fields import (
    FLAG,
    LABEL,
    NAMED,
    TEXT,
    Reader,
    Record,
    keyed,
    named,
    names_of,
    node_as,
    number,
    one_or_more,
    ref,
    sound,
)
from .files import named_file
from .parts import PartText, parts
from .questions import CLAIMS, GUIDELINE, QuestionReader, without
from .settings import Setting, parse_setting, settings_like
from .study_metric import StudyMetric, checked_metric

LARGE = 10_000_000  # bytes of a file
MAX_REPLICATIONS = 10**9
MAX_STUDY_SEED = MAX_SEED - MAX_REPLICATIONS
RESERVED = ("run", "condition", "replication", "seed", "status", "events", "digest", "error", "wall_time", "replay")


METRIC = Record.of(StudyMetric, "A number that is kept for each run.", type="object", required=["value"])
_METRICS = {"anyOf": [names_of({"anyOf": [LABEL, METRIC.schema]}), {"type": "array", "items": ref("name")}]}
_DISTURB = {"anyOf": [{"type": "object", "additionalProperties": one_or_more({"type": "string"})}, ref("texts")]}
_HAS_NO = ("{what} has no {key!r}", "write {{metric: mean_wait, half_width: 0.1, at_most: 1000}}")


@dataclass(frozen=True)
class Until:
    """Replications continue, ``batch`` by batch, until the 95 % interval of a metric's mean is narrow enough."""

    position: Position
    metric: str = keyed(TEXT.described(ref("name")), "The metric whose mean is estimated.", missing=_HAS_NO)
    half_width: float = keyed(
        number(float, 0.0), "Half the width of its 95 % interval at which replications stop.", missing=_HAS_NO
    )
    batch: int = keyed(
        number(int, 2, MAX_REPLICATIONS), "The number of replications made at a time (default: 10).", default=10
    )
    at_most: int = keyed(
        node_as(number(int, 2, MAX_REPLICATIONS).schema),  # whose bound is the batch
        "The maximum number of replications of a condition (default: 1000).",
        default=1000,
    )


UNTIL = Record.of(Until, type="object", required=["metric", "half_width"])


@dataclass(frozen=True)
class Study:
    """A model, the conditions under which it is run, and what is kept of each run, as its file declares it."""

    path: Path
    text: str
    name: str = keyed(
        NAMED,
        "The name of the study.",
        key="study",
        called="the study's name",
        missing=("the study has no name", "add a line like 'study: my_study'"),
        default="study",
    )
    doc: str = keyed(TEXT, "The question that it answers.", default="")
    model: str = keyed(
        Reader({"type": "string"}, lambda reader, node, what: reader.model(node, what)),
        "A packaged model, or the path of a file relative to this one.",
        called="the model",
        missing=("the study has no model", "add a line like 'model: mm1'"),
        default="",
    )
    fixed: tuple[Setting, ...] = keyed(
        settings_like("observer[*].sensor.range: 5 m"),
        "Values for parameters of the model in all runs: 'path: value'.",
        key="set",
        default=(),
    )
    dimensions: tuple[Dimension, ...] = keyed(
        DIMENSIONS, "What is varied; every value is combined with every value of the others.", key="vary", default=()
    )
    disturb: tuple[Dimension, ...] = keyed(
        Reader(_DISTURB, lambda reader, node, what: reader.disturb(node, what)),
        "Disturbances as another dimension: 'name: [disturbance, ...]', or a list of single ones.",
        default=(),
    )
    replications: int = keyed(
        number(int, 1, MAX_REPLICATIONS), "The number of runs of each condition (default: 1).", default=1
    )
    seed: int = keyed(number(int, 0, MAX_STUDY_SEED), "The seed of the first replication (default: 0).", default=0)
    paired: bool = keyed(
        FLAG, "Whether a replication has the same seed in all conditions (default: true).", default=True
    )
    until: Until | None = keyed(
        Reader(UNTIL.schema, lambda reader, node, what: reader.until(node, what)),
        "When the replications of each condition stop, instead of a fixed number of them.",
        default=None,
    )
    monitors: dict[str, Text] = keyed(
        named(ref("text"), lambda reader, name, entry: reader.placed(entry.value, f"monitor {name!r}")),
        "Properties that runs are to have, beside the monitors of the model: 'name: property'.",
        default_factory=dict,
    )
    metrics: tuple[StudyMetric, ...] | None = keyed(  # None: all of the model
        Reader(_METRICS, lambda reader, node, what: reader.metrics(node, what)),
        "What is kept for each run: names of the model's metrics, or 'name: expression', or "
        "'name: {value, unit, ...}'.",
        default=None,
    )
    claims: Node | None = keyed(
        CLAIMS, "Hypotheses on the results, by name; or the study whose claims are judged here, too.", default=None
    )
    guideline: Node | None = keyed(
        node_as(GUIDELINE.schema),
        "Which level of a factor to choose, for every combination of the others.",
        default=None,
    )
    figures: dict[str, PartText] | None = keyed(  # None: those that suit the table
        parts("figure", "study_figure"),
        "What the report shows: 'name: {type, ...}' (default: means and distributions of all metrics).",
        default=None,
    )
    questions: Questions = field(default_factory=Questions)  # which the claims and the guideline ask
    changes: tuple[str, ...] = ()  # --set, as given
    types: tuple[Path, ...] = ()
    aspects: tuple[str, ...] = ()  # --aspect
    without_aspects: tuple[str, ...] = ()  # --without
    stop: float | None = None  # s, instead of the model's

    @property
    def factors(self) -> dict[str, str]:
        """The columns of the table that show what was varied, and what they hold."""
        return {name: kind for dimension in self.dimensions for name, kind in dimension.columns.items()}


STUDY = Record.of(Study, "A model under many conditions.", required=["model"])


def is_study(path: Path) -> bool:
    """Whether a file declares a study."""
    with suppress(OSError):
        # A large model need not be read twice; a missing or oversized file is reported when it is read.
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
    """The study of a file; raises ``ModelError`` with everything that is wrong with its contents."""
    problems = Problems(OF_STUDY)
    path = find(str(name), "study", problems)
    node = None if path is None else read(path, problems)
    problems.raise_if_any()
    assert path is not None
    text = opened_text(path) or path.read_text(encoding="utf-8")
    return study_of_text(text, path, set, types, replications, seed, node=node)


def study_of_text(
    text: str,
    path: Path,
    set: Iterable[str] = (),
    types: Iterable[Path] = (),
    replications: int | None = None,
    seed: int | None = None,
    lender: tuple[str, str] | None = None,
    node: Node | None = None,
) -> Study:
    """The study in a text, with settings from outside; raises ``ModelError``.

    The text was once read from ``path``: the files that it names may no longer exist, unless it was read now, as this
    ``node``.  ``lender``: file and text of the study that its claims are from.
    """
    problems = Problems(OF_STUDY)
    reader = _StudyReader(problems, path, lender, asks_for_files=node is not None)
    tree = node or parse(text, str(path), problems)
    problems.raise_if_any()
    assert tree is not None, "a text that cannot be read is a problem"
    study, changes = problems.whole(reader.study(tree, text)), tuple(set)
    settings = [each for change in changes if (each := parse_setting(change, problems)) is not None]
    for each in settings:
        if each.path in study.factors:
            message = f"{each.position.source}: the study varies {each.path}"
            problems.add(message, None, "change it in the study")
    problems.raise_if_any()
    return replace(
        study,
        replications=study.replications if replications is None else replications,
        seed=study.seed if seed is None else seed,
        fixed=(*study.fixed, *settings),
        changes=changes,
        types=tuple(types),
    )


class _StudyReader(NodeReader):
    """Reads one study file; anything malformed is added to ``problems`` and left out."""

    def __init__(
        self, problems: Problems, path: Path, lender: tuple[str, str] | None = None, *, asks_for_files: bool = True
    ) -> None:
        super().__init__(problems)
        self.path = path
        self.asks_for_files = asks_for_files  # whether what is named must exist
        self.lender = lender  # file and text of the study whose claims are judged here, if they are known

    def study(self, node: Node, text: str) -> Study | None:
        if (
            isinstance(node, Mapping)
            and "study" not in node.entries
            and node.entries.keys() & {"actors", "disturbance"}
        ):
            self.problems.add(
                f"{self.path} is not a study", node.position, "a study begins with a line like 'study: my_study'"
            )
            return None
        entries = STUDY.entries(self, node, "the study")
        if entries is POISON:
            return None
        said = sound(STUDY.values(self, entries, "the study", node.position))
        if self.asks_for_files and "until" in entries and "replications" in entries:  # runs of earlier versions stay
            message = "'until' decides how many replications there are, so 'replications' would do nothing"
            self.problems.add(message, entries["replications"].key.position, "remove it, or give 'at_most' in 'until'")
        said["dimensions"] = (*said.get("dimensions", ()), *said.get("disturb", ()))
        study = Study(self.path, text, **said)
        before = len(self.problems)
        self.columns(study)
        varied = entries["vary"].value if "vary" in entries else None
        is_whole = not isinstance(varied, Mapping) or len(study.dimensions) >= len(varied.entries)
        if len(self.problems) > before or not is_whole:
            return study  # what is asked of it would be reported as not varied
        reader = QuestionReader(self.problems, study.dimensions, study.factors, study.path.parent, self.factors_of)
        return replace(study, questions=reader.questions(entries, self.lender))

    def factors_of(self, node: Node, path: Path, problems: Problems) -> dict[str, str]:
        """What another study varies; this study judges its claims."""
        reader = _StudyReader(problems, path, asks_for_files=self.asks_for_files)
        found = reader.study(without(node, "claims", "guideline"), "")
        return {} if found is None else found.factors

    # -- values ---------------------------------------------------------------------------------------------------

    def model(self, node: Node, what: str) -> str:
        """A packaged model's name, or a file's name relative to the study's folder."""
        name = self.text(node, what) or ""
        if is_path(name):
            file = self.path.parent / name
            reason = unreadable(file) if self.asks_for_files else ""
            if reason is None:
                beside = [each.name for each in file.parent.glob("*.yaml")] if file.parent.is_dir() else []
                self.problems.add(f"there is no file {name!r}{did_you_mean(file.name, beside)}", node.position)
            elif reason:
                self.problems.add(f"the model {name!r} {reason}", node.position)
            return str(file)
        if self.asks_for_files:
            find(name, "model", self.problems, node.position)
        return name

    def disturb(self, node: Node, what: str) -> list[Dimension]:
        """Variants by name, ``{none: [], wifi: wifi_burst}``, or a list in which each entry is a variant."""
        if isinstance(node, Mapping):
            variants = {name: self.texts(each.value, "a disturbance") or () for name, each in node.entries.items()}
        else:
            variants = {}
            for text in self.texts(node, what) or ():
                name = Path(text.text).stem
                if name in variants:
                    hint = f"give each a name of its own: '{what}: {{first: FILE, second: FILE}}'"
                    self.problems.add(f"{what} lists {name!r} twice", text.position, hint)
                variants.setdefault(name, (text,))
        levels = []
        for variant, texts in variants.items():
            if self.asks_for_files:
                for text in texts:
                    named_file(text, self.path.parent, "disturbance", self.problems)
            names = [str(self.path.parent / each.text) if is_path(each.text) else each.text for each in texts]
            levels.append(Level((), {"disturb": variant}, tuple(names)))
        return [Dimension(what, node.position, {"disturb": "text"}, levels)] if levels else []

    # -- what is kept ---------------------------------------------------------------------------------------------

    def metrics(self, node: Node, what: str) -> tuple[StudyMetric, ...]:
        """A list of names, or a mapping from names to expressions."""
        found: list[StudyMetric | None] = []
        if isinstance(node, Mapping):
            found += [self.metric(name, entry) for name, entry in self.named(node, what) or ()]
        else:
            for item in self.items(node, what) or ():
                if (name := self.name(item, "the metric")) and isinstance(item, Scalar):
                    found.append(checked_metric(name, item, self.problems))
        return tuple(each for each in found if each is not None)

    def metric(self, name: str, entry: Entry) -> StudyMetric | None:
        """An expression, by default the metric with that name, or ``{value: expression, unit: s, to: min, ...}``."""
        if isinstance(entry.value, Scalar):
            return checked_metric(name, entry.key if is_empty(entry.value) else entry.value, self.problems)
        value: Node | None = entry.value
        what, said, places = f"metric {name!r}", {}, {}
        if isinstance(entry.value, Mapping):
            entries = METRIC.entries(self, entry.value, what) or {}
            said = sound(METRIC.values(self, entries, what, entry.key.position))
            places = {key: each.value.position for key, each in entries.items()}
            value = said.pop("node", None)
        if isinstance(value, Scalar):
            return checked_metric(name, value, self.problems, said, places)
        if value is not None:
            self.problems.add(f"{what} is not an expression", value.position)
        return None

    def until(self, node: Node, what: str) -> Until | Poison:
        """``{metric: mean_wait, half_width: 0.1, batch: 10, at_most: 1000}``."""
        entries = UNTIL.entries(self, node, what) or {}
        said = UNTIL.values(self, entries, what, node.position)
        least = said.get("batch", 10) or 10
        if "at_most" in said:
            said["at_most"] = number(int, least, MAX_REPLICATIONS).read(self, said["at_most"], "at_most")
        said.setdefault("at_most", max(1000, least))
        if POISON in said.values():
            return POISON
        at: Position = entries["metric"].value.position
        return Until(at, **said)

    def columns(self, study: Study) -> None:
        """Check that every column of the table has a unique name."""
        seen: dict[str, Position] = {}
        for dimension in study.dimensions:
            for name in dimension.columns:
                if name in RESERVED or name in seen:
                    reason = (
                        "the table already has a column with that name" if name in RESERVED else "it is varied twice"
                    )
                    self.problems.add(f"{name!r} cannot be varied: {reason}", dimension.position)
                seen[name] = dimension.position
        for metric in study.metrics or ():
            assert metric.node is not None
            if metric.name in RESERVED or metric.name in seen:
                message = f"a metric cannot be called {metric.name!r}: the table already has a column with that name"
                self.problems.add(message, metric.node.position, "give it another name: metrics: {name: expression}")
            seen[metric.name] = metric.node.position
