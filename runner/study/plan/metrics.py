"""Metrics of a study: whether its models have what they ask for, and their values in a run."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from epicycle.actors import EpicycleError, Quantity, did_you_mean
from epicycle.actors.expression import operand

from ...build import Model
from ...catalogue import conversion_problem
from ...engine import Results, Signal
from ...language import ASPECTS, NUMBERS, SIGNALS, StudyMetric, asks_for_none
from ...text import Problems, inside


class MetricError(EpicycleError):
    """A metric of a study that is no number."""


def check_metric(metric: StudyMetric, models: Sequence[Model], problems: Problems) -> None:
    """Note names that none of the models knows."""
    metrics = list(dict.fromkeys(each.name for model in models for each in model.metrics))
    figures = {
        woven.name: list(dict.fromkeys([*woven.aspect.events, *woven.aspect.reports]))
        for model in models
        for woven in model.aspects
    }
    recorded = list(dict.fromkeys(name for model in models for name in model.recorded))
    for name in metric.formula.names:
        if name not in (*metrics, ASPECTS, SIGNALS, *NUMBERS):
            _complain(metric, f"there is no metric {name!r}", name, metrics, "the model's metrics", problems)
    for aspect, figure in metric.figures:
        if aspect not in figures:
            _complain(metric, f"there is no aspect {aspect!r}", aspect, figures, "the model's aspects", problems)
        elif figure not in figures[aspect]:
            what = f"aspect {aspect} reports no {figure!r}"
            _complain(metric, what, figure, figures[aspect], "what it reports", problems)
    for signal in metric.signals:
        if signal not in recorded:
            _complain(metric, f"{signal!r} is not recorded", signal, recorded, "recorded by the model", problems)
    units = {each.name: each.unit for model in models for each in model.metrics}
    own = units.get(metric.source.strip(), "")
    if own and metric.unit and metric.unit != own:
        problems.add(
            f"metric {metric.name}: {metric.source.strip()} counts in {own}, not in {metric.unit}",
            metric.places.get("unit"),
            "leave 'unit' out; 'to: ...' converts",
        )
    elif found := conversion_problem(own or metric.unit, metric.to):
        problems.add(f"metric {metric.name}: {found[0]}", metric.places.get("to"), *([found[1]] if found[1] else []))


def value_of(metric: StudyMetric, results: Results) -> float | None:
    """The number for the table; None if there is none, as what it asks for is missing in this run.

    Raises ``EpicycleError`` if it cannot be evaluated, or is no number.
    """
    names: dict[str, Any] = {name: operand(value) for name, value in results.metrics.items()}
    names |= {name: getattr(results, name) for name in NUMBERS}
    asked = [names[name] for name in metric.formula.names if name in names]
    asked += [results.aspects.get(aspect, {}).get(figure) for aspect, figure in metric.figures]
    asked += [results.signals.get(signal) for signal in metric.signals]
    is_plain = metric.formula.names == (metric.source.strip(),)
    if None in asked and (is_plain or not asks_for_none(metric.source)):
        return None
    if metric.figures:
        names[ASPECTS] = results.aspects
    if metric.signals:
        names[SIGNALS] = {name: _as_operand(results.signals[name]) for name in metric.signals}
    value = metric.formula(names)
    if value is None:
        return None
    if not isinstance(value, (bool, int, float)):
        raise MetricError(f"metric {metric.name} is no number: {value!r}")
    unit = results.units.get(metric.source.strip()) or metric.unit
    return Quantity(float(value), unit).to(metric.to) if metric.to else float(value)


def _complain(
    metric: StudyMetric, message: str, part: str, known: Iterable[str], caption: str, problems: Problems
) -> None:
    names = list(known)
    position = None
    if metric.node is not None:
        position = inside(metric.node, metric.source, max(metric.source.find(part), 0), part)
    shown = ", ".join(names) or "none"
    problems.add(f"metric {metric.name}: {message}{did_you_mean(part, names)}", position, f"{caption}: {shown}")


def _as_operand(signal: Signal) -> dict[str, list[Any]]:
    return {"time": signal.times.tolist(), "value": [operand(token) for token in signal.tokens]}
