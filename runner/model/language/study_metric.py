"""What a study keeps for each run: metrics of the model, and expressions over them, aspects' figures and signals."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from epicycle.actors.expression import ExpressionError, Formula

from ..text.document import Scalar
from ..text.faults import blame
from ..text.problems import Position, Problems
from .fields import LABEL, TEXT, keyed, node_as

ASPECTS, SIGNALS = "aspects", "signals"
NUMBERS = ("end", "events", "firings")  # the other results that an expression knows


@dataclass(frozen=True)
class StudyMetric:
    """A column of the table, filled by an expression, such as the name of a metric of the model.

    In an expression, ``aspects['packet_loss']['dropped']`` is what an aspect reports, and ``signals['server.size']`` a
    recorded signal as ``{'time': [...], 'value': [...]}``; ``end`` is the time (s) up to which the run went, ``events``
    and ``firings`` are its numbers of these.
    """

    name: str
    source: str
    node: Scalar | None = keyed(  # None if the study takes all metrics of its model
        node_as(LABEL),
        "The expression, over metrics of the model and other results of a run.",
        key="value",
        missing=("{what} has no value", "add 'value: ...', an expression"),
        default=None,
    )
    unit: str = keyed(TEXT, "Its unit; a metric of the model has its own.", default="")
    to: str = keyed(TEXT, "Its unit in the table (default: the same).", default="")
    doc: str = keyed(TEXT, "What it is.", default="")
    label: str = keyed(TEXT, "Its label in figures and reports (default: the model's label, or its name).", default="")
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
        return Formula(self.source)

    def _place(self, source: str, part: str) -> tuple[int, int]:
        return max(source.find(part), 0), len(part)


def asks_for_none(source: str) -> bool:
    """Whether an expression deals with missing numbers itself: ``30 if arrival == None else arrival``."""
    return any(
        isinstance(node, ast.Constant) and node.value is None
        for node in ast.walk(ast.parse(" ".join(source.split()), mode="eval"))
    )


def checked_metric(
    name: str,
    node: Scalar,
    problems: Problems,
    said: Mapping[str, str] = MappingProxyType({}),
    places: Mapping[str, Position] = MappingProxyType({}),
) -> StudyMetric | None:
    """A metric as a study file declares it; ``said`` holds its unit and other options."""
    source = node.text
    try:
        return StudyMetric(name, source, node, **said, places=dict(places))
    except ExpressionError as error:
        blame(problems, f"metric {name}", error, node)
        return None
