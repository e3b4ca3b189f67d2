"""What the columns of a table are: their units and docs, as the model declares them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from epicycle.actors import declared_parameters, parse_unit

from ...build import Model
from ...language import Dimension, StudyMetric, split_number
from ...text import select


@dataclass(frozen=True)
class Column:
    """A column of the table: what it counts in (empty if that is not known), and what it is."""

    unit: str = ""
    doc: str = ""


def columns_of(dimensions: Iterable[Dimension], metrics: Iterable[StudyMetric], model: Model) -> dict[str, Column]:
    """The columns that say what was varied and what came out, by name."""
    found: dict[str, Column] = {}
    for dimension in dimensions:
        for setting in dimension.level(0).settings:
            if setting.path not in dimension.columns:
                continue
            declared = _declared(setting.path, model)
            written = split_number(setting.node)
            # A number with a unit is in the table in SI units, one without in the parameter's own.
            unit = si_unit(written[1]) if written is not None and written[1] else declared.unit
            found[setting.path] = Column(unit, declared.doc)
    own = {metric.name: Column(metric.unit, metric.measure.doc) for metric in model.metrics}
    for metric in metrics:
        known = own.get(metric.source.strip(), Column())
        found[metric.name] = Column(metric.to or known.unit or metric.unit, metric.doc or known.doc)
    return found


def _declared(path: str, model: Model) -> Column:
    """Unit and doc of a parameter of the model, or of those actors' that a pattern selects."""
    if path in model.declared:
        return Column(*model.declared[path])
    owner, _, name = path.rpartition(".")
    for actor in select(owner, model.graph.actors) if owner else ():
        parameter = declared_parameters(type(model.graph.actors[actor])).get(name)
        if parameter is not None:
            return Column(parameter.unit, parameter.doc)
    return Column()


def si_unit(text: str) -> str:
    """The SI unit of what another unit measures; the same one, if that is of SI.  Raises ``UnitError``."""
    unit = parse_unit(text)
    if unit.factor == 1.0:
        return text
    powers = list(zip(("m", "kg", "s", "A", "K", "bit"), unit.dimension, strict=True))
    above = ["rad"] * (unit.pi_power != 0) + [_power(axis, power) for axis, power in powers if power > 0]
    below = [_power(axis, -power) for axis, power in powers if power < 0]
    product, divisor = " ".join(above) or "1", " ".join(below)
    if not below:
        return product
    return f"{product}/({divisor})" if len(below) > 1 else f"{product}/{divisor}"


def _power(axis: str, power: int) -> str:
    return axis if power == 1 else f"{axis}^{power}"
