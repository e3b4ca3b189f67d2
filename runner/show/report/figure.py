"""Figures of a study: what its ``figures`` may ask for, and what they have in common."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

from epicycle.actors import Configurable, MappingParameter, Parameter, counted, did_you_mean

from ...build import Complaint, Model
from ...language import Dimension, Factor
from ...results import Results
from ...study import Plan
from ..sheet import DASHES, FEW, MARKERS, MAX_LINES, MAX_PANELS, Sheet, colours
from .data import MAX_LISTED, Condition, Data, Names, is_numeric, shown

# The parameters of figures that name parts of the study, as far as a figure has them.
_NAMED = {
    "where": "factor",
    "lines": "factor",
    "panels": "factor",
    "over": "factor",
    "metric": "metric",
    "metrics": "metric",
    "labels": "column",
}

RunKey = tuple[int, int]  # a condition's number, and a replication


class Roles(NamedTuple):
    """What each factor is for in a figure: along the axis, a line, a panel."""

    over: str | None
    lines: str | None
    panels: tuple[str, ...]


class StudyFigure(Configurable):
    """Base of the figures of a study: declare parameters, write ``draw``."""

    reserved: ClassVar[frozenset[str]] = frozenset({"type"})

    doc = Parameter(str, "", doc="what the figure shows, for the line under it")
    where: Parameter[Mapping[str, Any]] = MappingParameter(
        Parameter(object), {}, doc="levels to which the figure keeps, such as {load: 0.5} or {load: [0.5, 0.9]}"
    )
    labels: Parameter[Mapping[str, str]] = MappingParameter(
        Parameter(str), {}, doc="what metrics and factors are called in it, without their units"
    )

    def complaints(self, plan: Plan) -> Iterator[Complaint]:
        """What is wrong with the figure in this study: names that it does not have, levels that do not occur."""
        factors, metrics = list(plan.study.factors), [metric.name for metric in plan.metrics]
        known = {"factor": factors, "metric": metrics, "column": factors + metrics}
        for parameter, noun in _NAMED.items():
            for name in self.named(parameter):
                if name not in known[noun]:
                    message = f"the study has no {noun} {name!r}{did_you_mean(name, known[noun])}"
                    yield Complaint(parameter, message, f"its {noun}s: {', '.join(known[noun]) or 'none'}", name)
        for name, wanted in self.where.items():
            dimension = next((each for each in plan.study.dimensions if name in each.columns), None)
            for level in wanted if isinstance(wanted, list) else [wanted]:
                if dimension is not None and not _has(dimension, name, level):
                    yield Complaint(
                        "where", f"{name} never is {shown(level)}", f"it is {_listed(dimension, name)}", name
                    )

    def named(self, parameter: str) -> tuple[str, ...]:
        """The names that a parameter holds; none if the figure has no such parameter."""
        value = getattr(self, parameter, None) or ()
        return (value,) if isinstance(value, str) else tuple(value)

    def arranged(self, data: Data, *, has_axis: bool = False, metrics: Sequence[str] = ()) -> Layout:
        """The conditions in panels and lines; with ``metrics``, these are the lines."""
        over = getattr(self, "over", None) if has_axis else None
        # A figure that has no such parameter draws one line a panel.
        lines = "" if metrics else getattr(self, "lines", "")
        found = roles(data.plan, self.where, over, lines, self.named("panels"), has_axis=has_axis)
        return Layout(data, self, found, metrics)

    def draw(self, data: Data, extracts: Mapping[RunKey, Any], paths: Sequence[Path]) -> str:
        """Write the figure to the files, and return what is to be said of it; ``extracts`` are of repeated runs."""
        raise NotImplementedError


class SignalFigure(StudyFigure):
    """Base of the figures that are drawn from signals: a study keeps none, but runs can be repeated."""

    signal_parameters: ClassVar[tuple[str, ...]] = ()  # those that hold patterns of output ports

    def runs_of(self, data: Data) -> list[RunKey]:
        """The runs that it wants to be repeated."""
        raise NotImplementedError

    def ports(self, model: Model) -> tuple[str, ...]:
        """The output ports that are to be recorded in these, as patterns."""
        return tuple(pattern for parameter in self.signal_parameters for pattern in self.named(parameter))

    def extract(self, model: Model, results: Results) -> Any:
        """What it needs of one of them, as plain data; called in the process that has made the run."""
        raise NotImplementedError

    def check_model(self, model: Model) -> Iterator[Complaint]:
        """What is wrong with it in this model, its signals apart."""
        yield from ()


def _has(dimension: Dimension, factor: str, level: Any) -> bool:
    try:
        if len(dimension.columns) == 1:
            return dimension.find({factor: level}) is not None
        return any(dimension.level(index).values[factor] == level for index in range(dimension.size))
    except (TypeError, ValueError, OverflowError):  # what is no number, or no finite one
        return False


def _listed(dimension: Dimension, factor: str) -> str:
    few = range(min(dimension.size, MAX_LISTED))
    texts = list(dict.fromkeys(shown(dimension.level(index).values[factor]) for index in few))
    return ", ".join(texts) + (", ..." if dimension.size > MAX_LISTED else "")


# -- panels and lines -------------------------------------------------------------------------------------------------


def roles(
    plan: Plan, fixed: Mapping[str, Any], over: str | None, lines: str | None, panels: Sequence[str], *, has_axis: bool
) -> Roles:
    """What each factor is for: as it is said, otherwise the first numbers are along the axis, the next factor makes
    lines, and all others panels.  Columns that vary together count once."""
    said = [name for name in (over, lines, *panels) if name]
    free = []
    for dimension in plan.study.dimensions:
        names = list(dimension.columns)
        settled = any(name in fixed and not isinstance(fixed[name], list) for name in names)
        if not settled and not set(names) & set(said):
            free.append(names[0])
    if has_axis and over is None and free:
        over = next((name for name in free if is_numeric(plan, name)), free[0])
        free.remove(over)
    if lines is None and free:
        lines = free.pop(0)
    return Roles(over, lines, (*panels, *free))


class Panel(NamedTuple):
    """One panel: its conditions, by the level of its lines."""

    title: str
    lines: dict[Factor, list[Condition]]


class Layout:
    """The conditions of a figure, sorted into panels and lines; then what the legend shows.

    More than can be told apart are left out, which ``omitted`` says.
    """

    def __init__(self, data: Data, figure: StudyFigure, found: Roles, metrics: Sequence[str] = ()) -> None:
        self.roles = found
        self._metrics = metrics
        self.names = Names(data.plan, figure.labels)
        self.chosen = data.where(figure.where)
        self.handles: dict[str, Any] = {}
        levels: list[Factor] = (
            data.levels(found.lines, self.chosen, figure.where) if found.lines else [*metrics] or [None]
        )
        choices = [data.levels(name, self.chosen, figure.where) for name in found.panels]
        panels = []
        for combination in product(*choices):
            place = dict(zip(found.panels, combination, strict=True))
            if here := [each for each in self.chosen if place.items() <= each.values.items()]:
                by_line = {
                    level: [each for each in here if not found.lines or each.values[found.lines] == level]
                    for level in levels[:MAX_LINES]
                }
                panels.append(Panel(self.names.place(place), by_line))
        omitted = []
        if len(levels) > MAX_LINES:
            omitted.append(f"Of {len(levels)} lines the first {MAX_LINES} are shown.")
        if len(panels) > MAX_PANELS:
            omitted.append(f"Of {counted(len(panels), 'panel')} the first {MAX_PANELS} are shown.")
        self.omitted = " ".join(omitted)
        self.panels, self.levels = panels[:MAX_PANELS], levels[:MAX_LINES]
        self.shades = colours(len(self.levels))
        # Two factors make rows and columns.
        self.columns = len(choices[1]) if len(choices) == 2 and 1 < len(choices[1]) <= 4 else None

    def sheet(self, **look: Any) -> Sheet:
        return Sheet(**{"panels": [panel.title for panel in self.panels] or [""], "columns": self.columns, **look})

    def look(self, number: int, *, marked: bool = False) -> dict[str, Any]:
        """How a line is drawn: few differ in more than their colours."""
        few = number < FEW and len(self.levels) <= FEW
        look = {"color": self.shades[number], "linestyle": DASHES[number] if few else "-"}
        return {**look, "marker": MARKERS[number] if few else "."} if marked else look

    def called(self, level: Factor) -> str:
        """What a line is called in the key."""
        return self.names.words(str(level)) if self._metrics else self.names.level(self.roles.lines or "", level)

    def about(self, panel: Panel, level: Factor) -> str:
        """Which panel and line a tip is of."""
        line = self.names.place({self.roles.lines: level}) if self.roles.lines else ""
        return ", ".join(filter(None, (line, panel.title)))

    def show(self, level: Factor, handle: Any) -> None:
        """Let the key say which line is that of a level."""
        if self.roles.lines or self._metrics:
            self.handles.setdefault(self.called(level), handle)

    def finish(self, sheet: Sheet, paths: Sequence[Path], *said: str) -> str:
        """Add the key, and write the files; what is said of the figure, and of what is left out of it."""
        title = self.names.words(self.roles.lines) if self.roles.lines else ""
        if len(self.levels) > FEW:
            sheet.band([*map(self.called, self.levels)], self.shades, title)
        else:
            sheet.legend(list(self.handles.values()), list(self.handles), title)
        sheet.save(paths)
        return " ".join(filter(None, (*said, self.omitted)))
