"""Metrics at the end of a run: of several ports, and computed from others."""

from __future__ import annotations

import math
import operator
import sys
from collections.abc import Iterable, Mapping
from functools import reduce
from graphlib import TopologicalSorter

from epicycle.actors import EpicycleError, Quantity

from ...model.graph.outputs import Metric
from ...support.shown import short
from ..results import Outcome
from .measurement import Measurement


class Measured:
    """A metric while the run goes on: one measurement of all its ports together, or one of each."""

    __slots__ = ("_across", "_of")

    def __init__(self, metric: Metric) -> None:
        self._across = metric.measure.across
        if self._across is None:
            self._of = dict.fromkeys(metric.ports, Measurement(metric)) or {"": Measurement(metric)}
        else:
            self._of = {port: Measurement(Metric(metric.name, [port], metric.measure)) for port in metric.ports}

    def at(self, port: str) -> Measurement:
        """That which takes in the tokens of a port."""
        return self._of[port]

    def outcome(self, end: int) -> Outcome:
        """Its value at a time (ns) up to which nothing more will come."""
        if self._across is None:
            return next(iter(self._of.values())).outcome(end)
        found = [(port, each.outcome(end)) for port, each in self._of.items()]
        for port, each in found:
            if each.value is None:
                return Outcome(missing=f"of {port}: {each.missing}")
            if not isinstance(each.value, (int, float)):
                return Outcome(missing=f"of {port}: {each.value!r} is not a number")
        if not found:
            return Outcome(missing="it has no ports")
        try:
            value = _of_several(self._across, [each.value for _, each in found])
        except (OverflowError, ValueError):  # of infinities
            return Outcome(missing="it is too large for a number")
        return Outcome(value, after=max(each.after for _, each in found))


def _of_several(across: str, values: list[float]) -> float:
    if across in ("min", "max"):
        return min(values) if across == "min" else max(values)
    if across == "sum" and all(isinstance(each, int) for each in values):
        return reduce(operator.add, values)
    total = math.fsum(values)
    return total if across == "sum" else total / len(values)


def add_computed(metrics: Iterable[Metric], outcomes: Mapping[str, Outcome]) -> dict[str, Outcome]:
    """All outcomes in the order of the metrics, those that are computed from others among them."""
    found, known = dict(outcomes), {each.name: each for each in metrics}
    needs = {name: each.formula.names for name, each in known.items() if each.formula is not None}
    for name in TopologicalSorter(needs).static_order():
        if name in needs:
            found[name] = _computed(known[name], found)
    return {name: found[name] for name in known}


def _computed(metric: Metric, outcomes: Mapping[str, Outcome]) -> Outcome:
    assert metric.formula is not None
    for name in metric.formula.names:
        if name not in outcomes:
            return Outcome(missing=f"{name} has been removed from the model")
        if outcomes[name].value is None:
            return Outcome(missing=f"{name} has no value: {outcomes[name].missing}")
    try:
        value = metric.formula({name: outcomes[name].value for name in metric.formula.names})
    except EpicycleError as error:
        return Outcome(missing=str(error))
    if not isinstance(value, (bool, int, float)) or not abs(value) <= sys.float_info.max:
        return Outcome(missing=f"{metric.formula.source!r} is {short(value)}, which is not a finite number")
    measure = metric.measure
    if measure.to and not isinstance(value, bool):
        value = Quantity(value, measure.own_unit).to(measure.to)
    return Outcome(value)
