"""What is watched of a model: how long it runs, what it records, and its metrics."""

from __future__ import annotations

from collections.abc import Mapping
from graphlib import CycleError, TopologicalSorter
from types import MappingProxyType
from typing import Any

from epicycle.actors import (
    FaultError,
    Parameter,
    ParameterError,
    Quantity,
    UnitError,
    accepts,
    declared_parameters,
    did_you_mean,
    parse_unit,
    type_name,
)
from epicycle.actors.expression import Formula, as_text
from epicycle.aspects import Reading

from ...support.shown import short
from ..catalogue.metrics import MetricSpec
from ..graph.model_graph import ModelGraph
from ..graph.outputs import Metric, Monitor, OutputSpec, Part
from ..language.metrics import WatchText
from ..language.models import ModelText
from ..language.values import Locals
from ..temporal import Condition, Property, PropertyError, Requirement, Sends, Spread, leaves, property_of, spread_of
from ..text.document import Entry, Node, Scalar, plain
from ..text.kinds import MONITOR
from ..text.limits import MAX_SEED, RAISE_IT
from ..text.patterns import PathIndex, PatternError, TooManyError
from ..text.problems import POISON, Poison, Position
from ..text.program import entries_of
from ..text.reading import Text, within
from .paths import Paths, View
from .resolve import ParameterResolver

_MOST = 2_000_000  # characters of a property that is written out for every place of a pattern


class OutputReader:
    """Adds to what is watched (``found``): ``read`` what a file declares, the others what a program asks for."""

    def __init__(self, graph: ModelGraph, values: ParameterResolver, found: OutputSpec | None = None) -> None:
        self.found = OutputSpec() if found is None else found.copy()
        self.graph = graph
        self.values = values
        self.problems = values.problems
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
            for pattern in (each for each in patterns or () if each and each.text not in seen):
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
        measure = self.values.configured(
            MetricSpec, text.values, local, what, text.position, make=MetricSpec.fitting, evaluated=given
        )
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
        name, what = text.name, f"monitor {text.name}"
        requirement = self.values.configured(
            Requirement, text.values, local, what, text.position, make=Requirement, evaluated=given
        )
        found = requirement and self._monitor(text, requirement)
        if not found:
            return
        self._watched += len(found.ports)
        for metric in found.metrics:
            if any(each.name == metric.name for each in self.found.metrics):
                message = f"monitor {name}: its result needs the name {metric.name!r}, which a metric has"
                self.problems.add(message, text.position, "rename one of the two")
        self.found.monitors.append(found)
        self.found.metrics += found.metrics

    def _monitor(self, text: WatchText, requirement: Requirement) -> Monitor | Poison:
        """The monitor of a requirement."""
        source, place = requirement.property, text.place("property")
        view = View(Paths(self.graph), text.name, "", self.problems, called="monitor")
        before = len(self.problems)
        try:
            spread = spread_of(source)
            paths = [""] if spread is None else self._spread(view, spread, place)
            if spread is not None and len(paths) * len(spread.body) > _MOST:
                message = f"for {len(paths):,} places, the property is longer than {_MOST:,} characters"
                raise PropertyError(message, spread.offset, len(spread.pattern))
            parts, size = [], 1.0
            for path in paths:
                tree = property_of(source if spread is None else spread.of(path))
                parts.append(Part(path, tree, [_readings(view, each, place) for each in leaves(tree)]))
                try:
                    size = _size(tree, requirement.unit)
                except FaultError as error:
                    view.blame(error, text.place("unit"))
                if len(self.problems) > before:  # the others would say the same
                    return POISON
        except PropertyError as error:
            # The part that is wrong, if the text is in the file unchanged.
            whole = within(place, source)
            is_written = whole.length == len(source) and "\n" not in source
            return view.blame(error, Scalar(source, source, True, whole) if is_written else whole)
        if len(self.problems) > before:
            return POISON
        return Monitor(text.name, requirement, parts, spread is not None and spread.any, size)

    def _spread(self, view: View, spread: Spread, place: Position) -> list[str]:
        """The actors and composites that a pattern selects; if there are none, the output ports."""
        what, pattern = f"monitor {view.name}", Text(spread.pattern, within(place, spread.pattern))
        holders = view.paths.holders
        found = self._found(holders, pattern, what)
        if found == []:
            found = self._found(self._outputs, pattern, what)
        if found == [] and not self.graph.excuses(f"{pattern.text}.*"):
            message = f"{what}: {pattern.text!r} matches no actor, composite or output port"
            self.problems.add(message, place, near=holders.near(pattern.text))
        return found or []

    def options(self, cls: type, what: str, given: Mapping[str, object], position: Position) -> dict[str, Entry]:
        """The options that a program gives; unknown ones are reported."""
        declared = declared_parameters(cls)
        for key in given.keys() - declared.keys():
            self.problems.add(f"{what}: there is no option {key!r}{did_you_mean(key, declared)}", position)
        return entries_of({key: value for key, value in given.items() if key in declared}, position)

    def select(self, text: Text, what: str) -> list[str]:
        """The output ports that a pattern selects, including those of composites."""
        found = self._found(self._outputs, text, what)
        if found or found is POISON or self.graph.excuses(text.text):
            return found or []
        message, hints = f"{what}: {text.text!r} matches no output port", self._outputs.advice(text.text)
        if text.text in self.graph.ports:
            message, hints = f"{what}: {text.text} is an input port, but an output port is needed", ()
        self.problems.add(message, text.position, *hints, near=self._outputs.near(text.text))
        return []

    def _found(self, index: PathIndex, text: Text, what: str) -> list[str] | Poison:
        """What a pattern selects; poison if it is none."""
        try:
            return index.select(text.text)
        except PatternError as error:
            return self.problems.add(f"{what}: {text.text!r} is not a pattern: {error}", text.position)
        except TooManyError as error:
            self.problems.stop(f"{what}: {error}", text.position, RAISE_IT)


def _size(tree: Property, unit: str) -> float:
    """The size of the unit of a robustness, in what the margins are in; raises ``FaultError`` if it does not fit.

    Where numbers have units, all counts in SI; elsewhere, the unit is that of what the ports send.
    """
    conditions = [each for each in leaves(tree) if isinstance(each, Condition)]
    if not unit or not any(each.units for each in conditions):
        return 1.0
    try:
        size = parse_unit(unit).factor
    except UnitError as error:
        advice = "write the unit in which its robustness is to be given, such as m"
        raise FaultError(f"unit: {error}", help=[advice]) from None
    for condition in conditions:
        for other in condition.compared:
            try:
                Quantity(1.0, other).to(unit)
            except UnitError:
                problem = f"its robustness cannot be given in {unit!r}: {condition.source!r} compares in {other!r}"
                advice = f"write 'unit: {other}', or, where units differ, a monitor for each, or no unit"
                raise FaultError(problem, help=[advice]) from None
    return size


def _readings(view: View, condition: Condition | Sends, place: Position) -> list[Reading]:
    """What a condition reads."""
    if isinstance(condition, Sends):
        port, fields = view.reading("property", condition.port, within(place, condition.port))
        if fields:
            message = f"monitor {view.name}: 'sends {condition.port}' names a part of what {port} sends"
            view.problems.add(message, place, f"write 'sends {port}'")
        return [(port, ())]
    found = []
    for reference in condition.references:
        found.append(view.reading("property", reference, within(place, reference)))
    return found


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
