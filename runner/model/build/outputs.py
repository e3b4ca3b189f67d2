"""What is watched of a model: how long it runs, what it records, and its metrics."""

from __future__ import annotations

from collections.abc import Mapping
from graphlib import CycleError, TopologicalSorter
from types import MappingProxyType
from typing import Any

from epicycle.actors import Parameter, ParameterError, accepts, declared_parameters, did_you_mean, type_name
from epicycle.actors.expression import Formula, as_text

from ...support.shown import short
from ..catalogue.metrics import MetricSpec
from ..graph.model_graph import ModelGraph
from ..graph.outputs import Metric, OutputSpec
from ..language.metrics import WatchText
from ..language.models import ModelText
from ..language.values import Locals, Values
from ..temporal import Requirement
from ..text.document import Entry, Node, Scalar, plain
from ..text.kinds import MONITOR
from ..text.limits import MAX_SEED, RAISE_IT
from ..text.patterns import PathIndex, PatternError, TooManyError
from ..text.problems import POISON, Poison, Position, Problems
from ..text.program import entries_of
from ..text.reading import Text, within
from .configure import configure
from .monitors import monitor_of


class OutputReader:
    """Adds to what is watched (``found``): ``read`` what a file declares, the others what a program asks for."""

    def __init__(self, graph: ModelGraph, values: Values, problems: Problems, found: OutputSpec | None = None) -> None:
        self.found = OutputSpec() if found is None else found.copy()
        self.graph = graph
        self.values = values
        self.problems = problems
        outputs = (path for path, node in self.graph.ports.items() if node.direction == "output")
        self._outputs = PathIndex(outputs, self.graph.limits)
        self._recorded = set(self.found.recorded)
        self._watched = 0
        self._wrong: set[str] = set()  # metrics about which something has been said
        self._formulas: dict[str, Scalar] = {}  # of metrics that are computed from others

    def read(self, text: ModelText, names: dict[str, object]) -> OutputSpec:
        """Everything that the model file declares about it."""
        run, local = text.run, Locals("", names)
        for watch, patterns in ((self.record, run.record), (self.stop_when, run.stop_when)):
            seen: set[str] = set()  # each once: a pattern may select all of a model
            for pattern in (each for each in patterns if each and each.text not in seen):
                seen.add(pattern.text)
                watch(pattern)
        for key, computed in (("stop", run.stop), ("seed", run.seed)):
            value = POISON if computed is None else self.values.value(computed, local, key)
            if value is not POISON:
                setattr(self.found, "stop_time" if key == "stop" else "seed", value)
        for metric in text.metrics.values():
            self.metric(metric, local)
        with self.problems.looking_for(MONITOR):
            for monitor in text.monitors.values():
                self.monitor(monitor, local)
        self.check_formulas()
        return self.found

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

    def metric(self, text: WatchText, local: Locals, given: Mapping[str, object] | None = None) -> None:
        """Take one number from what the ports behind a pattern send, or compute it from other metrics.

        ``given`` are the values that a program gives for its options.
        """
        what = f"metric {text.name}"
        if given is None:  # text for people holds no expressions
            given = {key: _words(text.values[key].value) for key in _WORDS if key in text.values}
        make, at = MetricSpec.fitting, text.position
        measure = configure(MetricSpec, text.values, local, what, at, self.values, make=make, evaluated=given)
        if text.formula is not None:
            self._compute(text, text.formula, measure, local)
            return
        if not measure:
            self._wrong.add(text.name)
            return
        chosen = {path: each for each in reversed(text.ports) for path in self.select(each, what)}
        paths = self._outputs.in_order(chosen)
        self._watched += len(paths)
        limit = self.graph.limits.watched
        if self._watched > limit:
            self.problems.stop(f"{what}: metrics are taken from more than {limit:,} ports", text.position, RAISE_IT)
        self.found.metrics.append(Metric(text.name, paths, measure))
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

    def _compute(self, text: WatchText, source: Scalar, measure: MetricSpec | Poison, local: Locals) -> None:
        """Compute a number from other metrics; ``check_formulas`` says whether there are such."""
        name, what = text.name, f"metric {text.name}"
        formula: Formula | Poison = self.values.converted(source, local, what, _formula)
        if not formula or not measure:
            self._wrong.add(name)
            return
        if not formula.names:
            hint = "write an expression over others, such as 'delivered / sent'"
            self.problems.add(f"{what}: {formula.source!r} names no metric", source.position, hint)
        else:
            self._formulas[name] = source
            self.found.metrics.append(Metric(name, [], measure, formula=formula))

    def check_formulas(self) -> None:
        """Whether the metrics that others are computed from are there, and lead to none of these."""
        names = {each.name: each for each in self.found.metrics}
        sorter: TopologicalSorter[str] = TopologicalSorter()
        for name, source in self._formulas.items():
            formula = names[name].formula
            assert formula is not None
            sorter.add(name, *formula.names)
            for each in formula.names:
                if each not in names and each not in self._wrong:
                    near = each, [other for other in names if other != name]
                    hint = f"metrics of the model: {', '.join(other for other in names if other != name) or 'none'}"
                    message = f"metric {name}: there is no metric {each!r}"
                    self.problems.add(message, within(source.position, each), hint, near=near)
        try:
            sorter.prepare()
        except CycleError as error:
            circle = error.args[1][::-1]
            message = f"metric {circle[0]}: it is computed from itself: {' <- '.join(circle)}"
            self.problems.add(message, self._formulas[circle[0]].position)

    def monitor(self, text: WatchText, local: Locals, given: Mapping[str, object] = MappingProxyType({})) -> None:
        """Judge the runs by a property."""
        name, what, at = text.name, f"monitor {text.name}", text.position
        requirement = configure(
            Requirement, text.values, local, what, at, self.values, make=Requirement, evaluated=given
        )
        found = requirement and monitor_of(self.graph, text, requirement, self.problems)
        if not found:
            return
        self._watched += len(found.ports)
        for metric in found.metrics:
            if any(each.name == metric.name for each in self.found.metrics):
                message = f"monitor {name}: its result needs the name {metric.name!r}, which a metric has"
                self.problems.add(message, text.position, "rename one of the two")
        self.found.monitors.append(found)
        self.found.metrics += found.metrics

    def options(self, cls: type, what: str, given: Mapping[str, object], position: Position) -> dict[str, Entry]:
        """The options that a program gives; unknown ones are reported."""
        declared = declared_parameters(cls)
        for key in given.keys() - declared.keys():
            self.problems.add(f"{what}: there is no option {key!r}{did_you_mean(key, declared)}", position)
        return entries_of({key: value for key, value in given.items() if key in declared}, position)

    def select(self, text: Text, what: str) -> list[str]:
        """The output ports that a pattern selects, including those of composites."""
        try:
            found = self._outputs.select(text.text)
        except PatternError as error:
            self.problems.add(f"{what}: {text.text!r} is not a pattern: {error}", text.position)
            return []
        except TooManyError as error:
            self.problems.stop(f"{what}: {error}", text.position, RAISE_IT)
        if found or self.graph.excuses(text.text):
            return found
        message, hints = f"{what}: {text.text!r} matches no output port", self._outputs.advice(text.text)
        if text.text in self.graph.ports:
            message, hints = f"{what}: {text.text} is an input port, but an output port is needed", ()
        self.problems.add(message, text.position, *hints, near=self._outputs.near(text.text))
        return []


def _formula(value: object) -> Formula:
    if not isinstance(value, (str, bool, int, float)):
        raise ParameterError(f"{short(value)} is not an expression")
    return Formula(str(as_text(value)))


_WORDS = ("take", "unit", "to", "doc", "label")


def _words(node: Node) -> object:
    """A text, which may look like something else: ``unit: 1``."""
    return node.text if isinstance(node, Scalar) and node.value is not None else plain(node)


def checked_seed(value: object) -> int:
    """A seed as a whole number; raises ``ParameterError``.  Larger ones would not fit the columns of result files."""
    seed: Any = Parameter(int, min=0, max=MAX_SEED).convert(value)
    return int(seed)
