"""What is watched of a model: how long it runs, what it records, and its metrics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from epicycle.actors import Parameter, ParameterError, accepts, declared_parameters, to_nanoseconds, type_name

from ..text import RAISE_IT, Node, Position, Problems, Scalar, Text, did_you_mean, plain
from .declarations import DeclarationReader, MetricText, ModelText
from .measure import Measure
from .patterns import PathIndex, PatternError, TooManyError
from .values import Values

if TYPE_CHECKING:
    from .model import Model

# Larger seeds could not be told apart in the int64 columns of result files.
MAX_SEED = 2**63 - 1


@dataclass
class Metric:
    """A number taken from what some ports send together."""

    name: str
    ports: list[str]
    measure: Measure

    @property
    def unit(self) -> str:
        """What it counts in."""
        return self.measure.to or self.measure.own_unit


class Observation:
    """Lets a model be watched: ``read`` does what its file says, the others what a program asks for."""

    def __init__(self, model: Model, values: Values, problems: Problems) -> None:
        self.model = model
        self.graph = model.graph
        self.values = values
        self.problems = problems
        ports = self.graph.ports.nodes(data="direction")
        outputs = (path for path, direction in ports if direction == "output")
        self._outputs = PathIndex(outputs, self.graph.limits)
        self._recorded = set(model.recorded)
        self._watched = 0

    def read(self, text: ModelText, names: dict[str, object]) -> None:
        """Everything that the model file says about it."""
        reader = DeclarationReader(self.problems)
        for key, entry in text.run.items():
            if key == "record":
                for each in _different(reader.texts(entry.value, key)):
                    self.record(each)
            elif key == "stop_when":
                for each in _different(reader.texts(entry.value, key)):
                    self.stop_when(each)
            else:
                value = self.values.of(entry.value, names, key)
                if value is self.values.missing:
                    continue
                try:
                    if key == "stop":
                        self.model.stop_time = nanoseconds(value)
                    else:
                        self.model.seed = checked_seed(value)
                except (ParameterError, ValueError) as error:
                    self.problems.add(f"{key}: {error}", entry.value.position)
        for metric in text.metrics:
            self._read_metric(metric, names)

    def _read_metric(self, text: MetricText, names: dict[str, object]) -> None:
        """A metric as the file gives it."""
        values: dict[str, object] = {}
        for key, entry in text.values.items():
            # What is only read by people holds no expressions.
            if key in ("take", "unit", "to", "doc"):
                values[key] = _words(entry.value)
            else:
                values[key] = self.values.of(entry.value, names, f"metric {text.name}, {key}")
        places = {key: entry.value.position for key, entry in text.values.items()}
        if self.values.missing not in values.values():
            self.metric(text.name, text.port, values, text.position, places)

    def record(self, text: Text) -> None:
        """Keep what the ports behind a pattern send."""
        found = [path for path in self.select(text, "record") if path not in self._recorded]
        self._recorded.update(found)
        self.model.recorded += found

    def stop_when(self, text: Text) -> None:
        """End the run when a port behind the pattern sends something true."""
        self.graph.positions["stop_when"] = text.position
        for path in self.select(text, "stop_when"):
            self.model.stop_ports.append(path)
            for port in self.graph.source_of(path):
                if not accepts(float | bool, port.type):
                    self.problems.add(
                        f"stop_when: {path} sends {type_name(port.type)}, which is neither true nor false",
                        text.position,
                        "name a port that sends bool or numbers; the run ends when it sends true, or not 0",
                    )
                    return

    def metric(
        self,
        name: str,
        of: Text,
        options: Mapping[str, object],
        position: Position,
        places: Mapping[str, Position] | None = None,
    ) -> None:
        """Take one number from what the ports behind a pattern send; ``places``: where its options stand."""
        what = f"metric {name}"
        measure = self._measure(what, options, position, places or {})
        if measure is None:
            return
        self.graph.positions[what] = position
        paths = self.select(of, what)
        self._watched += len(paths)
        limit = self.graph.limits.watched
        if self._watched > limit:
            self.problems.add(f"{what}: metrics are taken from more than {limit:,} ports", position, RAISE_IT)
            self.problems.raise_if_any()
        self.model.metrics.append(Metric(name, paths, measure))
        if measure.kind.of == "any":
            return
        wanted: Any = float | bool if measure.kind.of == "numbers" else float | bool | str
        for path in paths:
            for port in self.graph.source_of(path):
                if port.type in (Any, object) or not accepts(wanted, port.type):
                    self.problems.add(
                        f"{what}: {path} sends {type_name(port.type)}, of which there is no {measure.take!r}",
                        of.position,
                        "name a port that sends numbers, or take 'count'",
                    )
                    return

    def _measure(
        self, what: str, options: Mapping[str, object], position: Position, places: Mapping[str, Position]
    ) -> Measure | None:
        """What is taken; None, and problems, if that cannot be."""
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
        """The output ports that a pattern selects, composites' included."""
        try:
            found = self._outputs.select(text.text)
        except PatternError as error:
            self.problems.add(f"{what}: {text.text!r} is no pattern: {error}", text.position)
            return []
        except TooManyError as error:
            self.problems.add(f"{what}: {error}", text.position, RAISE_IT)
            self.problems.raise_if_any()
            raise AssertionError("too many paths are a problem") from None
        if found or self.graph.is_excused(text.text):
            return found
        guess = self._outputs.did_you_mean(text.text)
        if text.text in self.graph.ports.nodes:
            self.problems.add(
                f"{what}: {text.text} is an input port, but an output port is needed{guess}", text.position
            )
        else:
            self.problems.add(
                f"{what}: {text.text!r} matches no output port{guess}",
                text.position,
                *self._outputs.advice(text.text),
            )
        return []


def _different(texts: list[Text]) -> list[Text]:
    """The texts, each once: a pattern may select all of a model."""
    found: dict[str, Text] = {}
    for each in texts:
        found.setdefault(each.text, each)
    return list(found.values())


def _words(node: Node) -> object:
    """A text, which may look like something else: ``unit: 1``."""
    return node.text if isinstance(node, Scalar) and node.value is not None else plain(node)


def nanoseconds(duration: object) -> int:
    """A time in seconds, or a text such as ``"500 ms"``, in ns; raises ``ParameterError`` or ``ValueError``."""
    seconds: Any = Parameter(float, unit="s", min=0.0).convert(duration)
    return to_nanoseconds(seconds)


def checked_seed(value: object) -> int:
    """A seed as a whole number; raises ``ParameterError``."""
    seed: Any = Parameter(int, min=0, max=MAX_SEED).convert(value)
    return int(seed)
