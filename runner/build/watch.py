"""What is watched of a model: how long it runs, what it records, and its metrics."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from graphlib import CycleError, TopologicalSorter
from typing import Any

from epicycle.actors import Parameter, ParameterError, accepts, declared_parameters, type_name
from epicycle.actors.expression import ExpressionError, Formula

from ..catalogue import Measure
from ..graph import Metric, Watched
from ..language import MetricText, ModelText, MonitorText, Values
from ..text import (
    MAX_SEED,
    RAISE_IT,
    Node,
    NodeReader,
    PathIndex,
    PatternError,
    Position,
    Problems,
    Scalar,
    Text,
    TooManyError,
    did_you_mean,
    plain,
    within,
)
from .draft import Draft
from .monitors import monitor_of
from .settle import converted, nanoseconds

# Larger seeds would not fit the int64 columns of result files.


class Watching:
    """Finds what is to be watched: ``read`` for what a file declares, the others for what a program asks for."""

    def __init__(self, draft: Draft, values: Values, problems: Problems, recorded: Collection[str] = ()) -> None:
        self.found = Watched()
        self.draft = draft
        self.graph = draft.graph
        self.values = values
        self.problems = problems
        outputs = (path for path, node in self.graph.ports.items() if node.direction == "output")
        self._outputs = PathIndex(outputs, self.graph.limits)
        self._recorded = set(recorded)
        self._watched = 0
        self._formulas: dict[str, Text] = {}  # of metrics that are computed from others

    def read(self, text: ModelText, names: dict[str, object]) -> Watched:
        """Everything that the model file declares about it."""
        reader = NodeReader(self.problems)
        for key, entry in text.run.items():
            if key in ("record", "stop_when"):
                watch = self.record if key == "record" else self.stop_when
                seen: set[str] = set()  # each once: a pattern may select all of a model
                for each in reader.texts(entry.value, key):
                    if each.text not in seen:
                        seen.add(each.text)
                        watch(each)
                continue
            convert = nanoseconds if key == "stop" else checked_seed
            value = converted(self.values, entry.value, names, key, "", convert)
            if value is not self.values.missing:
                setattr(self.found, "stop_time" if key == "stop" else "seed", value)
        for metric in text.metrics:
            self._read_metric(metric, names)
        for monitor in text.monitors:
            self._read_monitor(monitor, names)
        self.check_formulas()
        return self.found

    def _read_metric(self, text: MetricText, names: dict[str, object]) -> None:
        values: dict[str, object] = {}
        for key, entry in text.values.items():
            # Text for people holds no expressions.
            if key in ("take", "unit", "to", "doc", "label"):
                values[key] = _words(entry.value)
            else:
                values[key] = self.values.of(entry.value, names, f"metric {text.name}, {key}")
        places = {key: entry.value.position for key, entry in text.values.items()}
        if self.values.missing not in values.values():
            if text.formula is None:
                self.metric(text.name, text.ports, values, text.position, places)
            else:
                self.computed(text.name, text.formula, values, text.position, places)

    def _read_monitor(self, text: MonitorText, names: dict[str, object]) -> None:
        values: dict[str, object] = {}
        for key, entry in text.values.items():
            values[key] = self.values.of(entry.value, names, f"monitor {text.name}, {key}")
        places = {key: entry.value.position for key, entry in text.values.items()}
        if self.values.missing not in values.values():
            self.monitor(text.name, values, text.position, places)

    def record(self, text: Text) -> None:
        """Record what the ports behind a pattern send."""
        found = [path for path in self.select(text, "record") if path not in self._recorded]
        self._recorded.update(found)
        self.found.recorded += found

    def stop_when(self, text: Text) -> None:
        """End the run when a port behind the pattern sends something true."""
        self.found.stop_position = text.position
        for path in self.select(text, "stop_when"):
            self.found.stop_ports.append(path)
            for port in self.graph.source_of(path):
                if not accepts(float | bool, port.type):
                    message = f"stop_when: {path} sends {type_name(port.type)}, which is neither true nor false"
                    hint = "name a port that sends bool or numbers; the run ends at true, or a number other than 0"
                    self.problems.add(message, text.position, hint)
                    return

    def metric(
        self,
        name: str,
        of: Sequence[Text],
        options: Mapping[str, object],
        position: Position,
        places: Mapping[str, Position] | None = None,
    ) -> None:
        """Take one number from what the ports behind a pattern send; ``places``: where its options are written."""
        what = f"metric {name}"
        measure = self._measure(what, options, position, places or {})
        if measure is None:
            return
        chosen = {path: each for each in reversed(of) for path in self.select(each, what)}
        paths = self._outputs.in_order(chosen)
        self._watched += len(paths)
        limit = self.graph.limits.watched
        if self._watched > limit:
            self.problems.stop(f"{what}: metrics are taken from more than {limit:,} ports", position, RAISE_IT)
        self.found.metrics.append(Metric(name, paths, measure))
        if measure.kind.of == "any":
            return
        wanted: Any = float | bool if measure.kind.of == "numbers" else float | bool | str
        for path in paths:
            for port in self.graph.source_of(path):
                if port.type in (Any, object) or not accepts(wanted, port.type):
                    message = (
                        f"{what}: {path} sends {type_name(port.type)}, from which {measure.take!r} cannot be taken"
                    )
                    self.problems.add(message, chosen[path].position, "name a port that sends numbers, or take 'count'")
                    return

    def computed(
        self,
        name: str,
        source: Text,
        options: Mapping[str, object],
        position: Position,
        places: Mapping[str, Position] | None = None,
    ) -> None:
        """Compute a number from other metrics; ``check_formulas`` says whether there are such."""
        what = f"metric {name}"
        measure = self._measure(what, options, position, places or {})
        try:
            formula = Formula(source.text)
        except ExpressionError as error:
            wrong = source.text[error.offset : error.offset + max(error.length, 1)]
            self.problems.add(f"{what}: {error}", within(source, wrong) if wrong else source.position)
            return
        if not formula.names:
            hint = "write an expression over others, such as 'delivered / sent'"
            self.problems.add(f"{what}: {source.text!r} names no metric", source.position, hint)
        elif measure is not None:
            self._formulas[name] = source
            self.found.metrics.append(Metric(name, [], measure, formula=formula))

    def check_formulas(self, known: Iterable[str] = ()) -> None:
        """Whether the metrics that others are computed from are there, and lead to none of these."""
        own = {each.name: each for each in self.found.metrics}
        names = [*known, *own]
        sorter: TopologicalSorter[str] = TopologicalSorter()
        for name, source in self._formulas.items():
            formula = own[name].formula
            assert formula is not None
            sorter.add(name, *formula.names)
            for each in formula.names:
                if each not in names:
                    near = did_you_mean(each, [other for other in names if other != name])
                    hint = f"metrics of the model: {', '.join(other for other in names if other != name) or 'none'}"
                    message = f"metric {name}: there is no metric {each!r}{near}"
                    self.problems.add(message, within(source, each), hint)
        try:
            sorter.prepare()
        except CycleError as error:
            circle = error.args[1][::-1]
            message = f"metric {circle[0]}: it is computed from itself: {' <- '.join(circle)}"
            self.problems.add(message, self._formulas[circle[0]].position)

    def monitor(
        self, name: str, values: Mapping[str, object], position: Position, places: Mapping[str, Position] | None = None
    ) -> None:
        """Judge the runs by a property; ``places``: where its options are written."""
        found = monitor_of(self.draft, name, values, places or {}, position, self.problems)
        if found is None:
            return
        self._watched += len(found.ports)
        for metric in found.metrics:
            if any(each.name == metric.name for each in self.found.metrics):
                message = f"monitor {name}: its result needs the name {metric.name!r}, which a metric has"
                self.problems.add(message, position, "rename one of the two")
        self.found.monitors.append(found)
        self.found.metrics += found.metrics

    def _measure(
        self, what: str, options: Mapping[str, object], position: Position, places: Mapping[str, Position]
    ) -> Measure | None:
        before = len(self.problems)
        values: dict[str, object] = {}
        declared = declared_parameters(Measure)
        for key, value in options.items():
            if key not in declared:
                self.problems.add(f"{what}: there is no option {key!r}{did_you_mean(key, declared)}", position)
                continue
            try:
                values[key] = declared[key].convert(value)
            except ParameterError as error:
                self.problems.add(f"{what}, {key}: {error}", places.get(key, position))
        if len(self.problems) > before:
            return None
        measure = Measure(**values)
        for option, problem, advice in measure.misfits():
            self.problems.add(f"{what}: {problem}", places.get(option, position), *([advice] if advice else []))
        return measure

    def select(self, text: Text, what: str) -> list[str]:
        """The output ports that a pattern selects, including those of composites."""
        try:
            found = self._outputs.select(text.text)
        except PatternError as error:
            self.problems.add(f"{what}: {text.text!r} is not a pattern: {error}", text.position)
            return []
        except TooManyError as error:
            self.problems.stop(f"{what}: {error}", text.position, RAISE_IT)
        if found or self.draft.excuses(text.text):
            return found
        guess = self._outputs.did_you_mean(text.text)
        if text.text in self.graph.ports:
            self.problems.add(
                f"{what}: {text.text} is an input port, but an output port is needed{guess}", text.position
            )
        else:
            self.problems.add(
                f"{what}: {text.text!r} matches no output port{guess}", text.position, *self._outputs.advice(text.text)
            )
        return []


def _words(node: Node) -> object:
    """A text, which may look like something else: ``unit: 1``."""
    return node.text if isinstance(node, Scalar) and node.value is not None else plain(node)


def checked_seed(value: object) -> int:
    """A seed as a whole number; raises ``ParameterError``."""
    seed: Any = Parameter(int, min=0, max=MAX_SEED).convert(value)
    return int(seed)
