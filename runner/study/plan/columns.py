"""The columns of a study's table: whether its models provide them, their values in a run, units and docs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from epicycle.actors import EpicycleError, Quantity, declared_parameters, did_you_mean, parse_unit
from epicycle.actors.expression import operand

from ...execution.engine import Results
from ...model.build.model import Model
from ...model.catalogue.metrics import conversion_fault, unit_before
from ...model.graph.outputs import Metric
from ...model.language.dimensions import Dimension, split_number
from ...model.language.study_metric import ASPECTS, NUMBERS, SIGNALS, StudyMetric, asks_for_none
from ...model.text.patterns import select
from ...model.text.problems import Problems
from ...model.text.reading import inside


@dataclass(frozen=True)
class Column:
    """A column of the table: its unit (empty if unknown), doc and label; a mean of what is true or false is a share."""

    unit: str = ""
    doc: str = ""
    label: str = ""
    is_share: bool = False


# -- metrics ----------------------------------------------------------------------------------------------------------


def check_metric(metric: StudyMetric, models: Sequence[Model], problems: Problems) -> None:
    """Note names that none of the models has."""

    def complain(message: str, part: str, known: Iterable[str], caption: str) -> None:
        position = None
        if metric.node is not None:
            position = inside(metric.node, metric.source, max(metric.source.find(part), 0), part)
        told = f"metric {metric.name}: {message}{did_you_mean(part, known)}"
        problems.add(told, position, f"{caption}: {', '.join(known) or 'none'}")

    units = {each.name: each.unit for model in models for each in model.output.metrics}
    figures = {
        woven.name: list(dict.fromkeys([*woven.aspect.events, *woven.aspect.reports]))
        for model in models
        for woven in model.aspects
    }
    recorded = list(dict.fromkeys(name for model in models for name in model.output.recorded))
    for name in metric.formula.names:
        if name not in (*units, ASPECTS, SIGNALS, *NUMBERS):
            complain(f"there is no metric {name!r}", name, units, "the model's metrics")
    for aspect, figure in metric.figures:
        if aspect not in figures:
            complain(f"there is no aspect {aspect!r}", aspect, figures, "the model's aspects")
        elif figure not in figures[aspect]:
            complain(f"aspect {aspect} reports no {figure!r}", figure, figures[aspect], "what it reports")
    for signal in metric.signals:
        if signal not in recorded:
            complain(f"{signal!r} is not recorded", signal, recorded, "recorded by the model")
    own = units.get(metric.source.strip(), "")
    if own and metric.unit and metric.unit != own:
        problems.add(
            f"metric {metric.name}: {metric.source.strip()} has the unit {own}, not {metric.unit}",
            metric.places.get("unit"),
            "leave 'unit' out; 'to: ...' converts",
        )
    elif found := conversion_fault(unit_before(own or metric.unit, metric.to), metric.to):
        problems.add(f"metric {metric.name}: {found.message}", metric.places.get("to"), *found.help)


def value_of(metric: StudyMetric, results: Results) -> float | None:
    """The number for the table; None if something that it needs is missing in this run.

    Raises ``EpicycleError`` if it cannot be evaluated, or is not a number.
    """
    names: dict[str, Any] = {name: operand(value) for name, value in results.metrics.items()}
    names |= {"end": results.until, "events": results.events, "firings": results.firings}
    asked = [names[name] for name in metric.formula.names if name in names]
    asked += [results.aspects.get(aspect, {}).get(figure) for aspect, figure in metric.figures]
    asked += [results.signals.get(signal) for signal in metric.signals]
    is_plain = metric.formula.names == (metric.source.strip(),)
    if None in asked and (is_plain or not asks_for_none(metric.source)):
        return None
    if metric.figures:
        names[ASPECTS] = results.aspects
    if metric.signals:
        signals = {name: results.signals[name] for name in metric.signals}
        names[SIGNALS] = {
            name: {"time": each.times.tolist(), "value": list(map(operand, each.tokens))}
            for name, each in signals.items()
        }
    value = metric.formula(names)
    if value is None:
        return None
    if not isinstance(value, (bool, int, float)):
        raise EpicycleError(f"metric {metric.name} is not a number: {value!r}")
    unit = unit_before(results.units.get(metric.source.strip()) or metric.unit, metric.to)
    return Quantity(float(value), unit).to(metric.to) if metric.to else float(value)


# -- descriptions of columns ------------------------------------------------------------------------------------------


def columns_of(dimensions: Iterable[Dimension], metrics: Iterable[StudyMetric], model: Model) -> dict[str, Column]:
    """The columns of factors and metrics, by name."""
    found: dict[str, Column] = {}
    for dimension in dimensions:
        for setting in dimension.level(0).settings:
            if setting.path in dimension.columns:
                declared = _declared(setting.path, model)
                written = split_number(setting.node)
                # In the table, a number with a unit is in SI units, one without in the parameter's unit.
                unit = si_unit(written[1]) if written is not None and written[1] else declared.unit
                found[setting.path] = Column(unit, declared.doc)
    own = {
        each.name: Column(each.unit, each.measure.doc, each.measure.label, _is_condition(each, model))
        for each in model.output.metrics
    }
    for metric in metrics:
        known = own.get(metric.source.strip(), Column())
        unit = metric.to or known.unit or metric.unit
        is_share = not metric.to and (known.is_share or metric.formula.is_condition)
        found[metric.name] = Column(unit, metric.doc or known.doc, metric.label or known.label, is_share)
    return found


def _is_condition(metric: Metric, model: Model) -> bool:
    """Whether its value is true or false in each run."""
    if metric.monitor:
        return metric.name == metric.monitor
    if metric.formula is not None:
        return metric.formula.is_condition
    sources = [port for path in metric.ports for port in model.graph.source_of(path)]
    is_token = metric.measure.take in ("first", "last", "min", "max") and metric.measure.across not in ("sum", "mean")
    return is_token and bool(sources) and all(port.type is bool for port in sources)


def _declared(path: str, model: Model) -> Column:
    """Unit and doc of a parameter of the model, or of the actors that a pattern selects."""
    if (declared := model.declared.get(path)) is not None:
        return Column(declared.unit, declared.doc)
    owner, _, name = path.rpartition(".")
    for actor in select(owner, model.graph.actors) if owner else ():
        if (parameter := declared_parameters(type(model.graph.actors[actor])).get(name)) is not None:
            return Column(parameter.unit, parameter.doc)
    return Column()


def si_unit(text: str) -> str:
    """The SI unit of the same quantity as another unit; the unit itself if it is one of SI. Raises ``UnitError``."""
    unit = parse_unit(text)
    if unit.factor == 1.0:
        return text

    def factors(sign: int) -> list[str]:
        powers = zip(("m", "kg", "s", "A", "K", "bit"), (sign * power for power in unit.dimension), strict=True)
        return [axis if power == 1 else f"{axis}^{power}" for axis, power in powers if power > 0]

    product = " ".join(["rad"] * (unit.pi_power != 0) + factors(1)) or "1"
    below = factors(-1)
    if not below:
        return product
    return f"{product}/({' '.join(below)})" if len(below) > 1 else f"{product}/{below[0]}"
