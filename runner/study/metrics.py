"""Metrics of a study: the model's own, and expressions over them, over aspects' figures and recorded signals."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from epicycle.actors import EpicycleError, Quantity, did_you_mean
from epicycle.actors.expression import ExpressionError, Formula, operand

from ..engine import Results, Signal
from ..model import Model
from ..model.measure import conversion_problem
from ..text import Position, Problems, Scalar, inside

ASPECTS, SIGNALS = "aspects", "signals"
NUMBERS = ("end", "events", "firings")  # what else of the results an expression knows


class MetricError(EpicycleError):
    """A metric of a study that is no number."""


@dataclass(frozen=True)
class StudyMetric:
    """A column of the table, filled by an expression; the name of a metric of the model is one already.

    In an expression, ``aspects['packet_loss']['dropped']`` is what an aspect reports, and ``signals['server.size']`` a
    recorded signal as ``{'time': [...], 'value': [...]}``; ``end``, ``events`` and ``firings`` are those of the run.
    """

    name: str
    source: str
    node: Scalar | None = None  # where it stands; none if the study takes all metrics of its model
    unit: str = ""  # what the expression counts in; a metric of the model has its own
    to: str = ""  # the unit in which the table holds it, if that is another one
    doc: str = ""
    places: dict[str, Position] = field(default_factory=dict, compare=False)  # of the unit and what follows
    figures: tuple[tuple[str, str], ...] = field(init=False)
    signals: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        """Raises ``ExpressionError``."""
        formula = Formula(self.source)
        code = " ".join(self.source.split())
        figures, signals, others = [], [], {ASPECTS: 0, SIGNALS: 0}
        for node in ast.walk(ast.parse(code, mode="eval")):
            match node:
                case ast.Name(id=name) if name in others:
                    others[name] += 1
                case ast.Subscript(
                    value=ast.Subscript(value=ast.Name(id="aspects"), slice=ast.Constant(value=str(aspect))),
                    slice=ast.Constant(value=str(figure)),
                ):
                    figures.append((aspect, figure))
                case ast.Subscript(value=ast.Name(id="signals"), slice=ast.Constant(value=str(signal))):
                    signals.append(signal)
        if others[ASPECTS] != len(figures):
            raise ExpressionError("write aspects['name']['figure']", *self._place(formula.source, ASPECTS))
        if others[SIGNALS] != len(signals):
            raise ExpressionError("write signals['actor.port']", *self._place(formula.source, SIGNALS))
        object.__setattr__(self, "figures", tuple(dict.fromkeys(figures)))
        object.__setattr__(self, "signals", tuple(dict.fromkeys(signals)))

    @property
    def formula(self) -> Formula:
        """The checked expression."""
        return Formula(self.source)

    def check(self, models: Sequence[Model], problems: Problems) -> None:
        """Note names that none of the models knows."""
        metrics = list(dict.fromkeys(metric.name for model in models for metric in model.metrics))
        figures = {
            woven.name: list(dict.fromkeys([*woven.aspect.events, *woven.aspect.reports]))
            for model in models
            for woven in model.aspects
        }
        recorded = list(dict.fromkeys(name for model in models for name in model.recorded))
        for name in self.formula.names:
            if name not in (*metrics, ASPECTS, SIGNALS, *NUMBERS):
                self._complain(f"there is no metric {name!r}", name, metrics, "the model's metrics", problems)
        for aspect, figure in self.figures:
            if aspect not in figures:
                self._complain(f"there is no aspect {aspect!r}", aspect, figures, "the model's aspects", problems)
            elif figure not in figures[aspect]:
                what = f"aspect {aspect} reports no {figure!r}"
                self._complain(what, figure, figures[aspect], "what it reports", problems)
        for signal in self.signals:
            if signal not in recorded:
                self._complain(f"{signal!r} is not recorded", signal, recorded, "recorded by the model", problems)
        units = {metric.name: metric.unit for model in models for metric in model.metrics}
        own = units.get(self.source.strip(), "")
        if own and self.unit and self.unit != own:
            problems.add(
                f"metric {self.name}: {self.source.strip()} counts in {own}, not in {self.unit}",
                self.places.get("unit"),
                "leave 'unit' out; 'to: ...' converts",
            )
        elif found := conversion_problem(own or self.unit, self.to):
            problems.add(f"metric {self.name}: {found[0]}", self.places.get("to"), *([found[1]] if found[1] else []))

    def value(self, results: Results) -> float | None:
        """The number for the table; None if there is none, as what it asks for is missing in this run.

        Raises ``EpicycleError`` if it cannot be evaluated, or is no number.
        """
        names: dict[str, Any] = {name: operand(value) for name, value in results.metrics.items()}
        names |= {name: getattr(results, name) for name in NUMBERS}
        asked = [names[name] for name in self.formula.names if name in names]
        asked += [results.aspects.get(aspect, {}).get(figure) for aspect, figure in self.figures]
        asked += [results.signals.get(signal) for signal in self.signals]
        is_plain = self.formula.names == (self.source.strip(),)
        if None in asked and (is_plain or not asks_for_none(self.source)):
            return None
        if self.figures:
            names[ASPECTS] = results.aspects
        if self.signals:
            names[SIGNALS] = {name: _as_operand(results.signals[name]) for name in self.signals}
        value = self.formula(names)
        if value is None:
            return None
        if not isinstance(value, (bool, int, float)):
            raise MetricError(f"metric {self.name} is no number: {value!r}")
        unit = results.units.get(self.source.strip()) or self.unit
        return Quantity(float(value), unit).to(self.to) if self.to else float(value)

    def _place(self, source: str, part: str) -> tuple[int, int]:
        return max(source.find(part), 0), len(part)

    def _complain(self, message: str, part: str, known: Iterable[str], caption: str, problems: Problems) -> None:
        names = list(known)
        position = None
        if self.node is not None:
            position = inside(self.node, self.source, max(self.source.find(part), 0), part)
        shown = ", ".join(names) or "none"
        problems.add(f"metric {self.name}: {message}{did_you_mean(part, names)}", position, f"{caption}: {shown}")


def asks_for_none(source: str) -> bool:
    """Whether an expression deals with missing numbers itself: ``30 if arrival == None else arrival``."""
    return any(
        isinstance(node, ast.Constant) and node.value is None
        for node in ast.walk(ast.parse(" ".join(source.split()), mode="eval"))
    )


def _as_operand(signal: Signal) -> dict[str, list[Any]]:
    return {"time": signal.times.tolist(), "value": [operand(token) for token in signal.tokens]}


def checked_metric(
    name: str,
    node: Scalar,
    problems: Problems,
    said: Mapping[str, str] = MappingProxyType({}),
    places: Mapping[str, Position] = MappingProxyType({}),
) -> StudyMetric | None:
    """A metric as a study file gives it; ``said`` are its unit and the like."""
    source = node.text
    try:
        return StudyMetric(name, source, node, **said, places=dict(places))
    except ExpressionError as error:
        at = inside(node, source, error.offset, source[error.offset : error.offset + max(error.length, 1)])
        problems.add(f"metric {name}: {error}", at)
        return None
