"""The base classes of the figures of a study, and their layout."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

from epicycle.actors import Configurable, Fault, MappingParameter, Parameter, counted, did_you_mean

from ...execution.results import Results
from ...model.build.model import Model
from ...model.language.dimensions import Dimension, Factor
from ...study.plan.plan import Plan
from ..sheet import DASHES, FEW, MARKERS, MAX_LINES, MAX_PANELS, Sheet, colours
from .data import MAX_LISTED, Condition, Data, Names, is_numeric, shown

# The parameters of figures that name parts of the study; a figure may have some of them.
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
    """The role of each factor in a figure: along the axis, as lines, as panels."""

    over: str | None
    lines: str | None
    panels: tuple[str, ...]


class StudyFigure(Configurable):
    """Base class of the figures of a study: declare parameters and write ``draw``."""

    reserved: ClassVar[frozenset[str]] = frozenset({"type"})

    doc = Parameter(str, "", doc="what the figure shows, for the caption")
    where: Parameter[Mapping[str, Any]] = MappingParameter(
        Parameter(object), {}, doc="levels that the figure is limited to, such as {load: 0.5} or {load: [0.5, 0.9]}"
    )
    labels: Parameter[Mapping[str, str]] = MappingParameter(
        Parameter(str), {}, doc="names of metrics and factors in it, without their units"
    )

    def complaints(self, plan: Plan) -> Iterator[Fault]:
        """Problems of the figure in this study: names that the study does not have, levels that do not occur."""
        factors, metrics = list(plan.study.factors), [metric.name for metric in plan.metrics]
        known = {"factor": factors, "metric": metrics, "column": factors + metrics}
        for parameter, noun in _NAMED.items():
            for name in self.named(parameter):
                if name not in known[noun]:
                    message = f"the study has no {noun} {name!r}{did_you_mean(name, known[noun])}"
                    valid = f"its {noun}s: {', '.join(known[noun]) or 'none'}"
                    yield Fault(message, (parameter, name), of_key=True, help=(valid,))
        for name, wanted in self.where.items():
            dimension = next((each for each in plan.study.dimensions if name in each.columns), None)
            for level in wanted if isinstance(wanted, list) else [wanted]:
                if dimension is not None and not _has(dimension, name, level):
                    message, levels = f"{name} is never {shown(level)}", f"it is {_listed(dimension, name)}"
                    yield Fault(message, ("where", name), of_key=True, help=(levels,))

    def named(self, parameter: str) -> tuple[str, ...]:
        """The names that a parameter holds; none if the figure has no such parameter."""
        value = getattr(self, parameter, None) or ()
        return (value,) if isinstance(value, str) else tuple(value)

    def arranged(self, data: Data, *, has_axis: bool = False, metrics: Sequence[str] = ()) -> Layout:
        """The conditions in panels and lines; with ``metrics``, these are the lines."""
        over = getattr(self, "over", None) if has_axis else None
        # A figure without this parameter draws one line per panel.
        lines = "" if metrics else getattr(self, "lines", "")
        found = roles(data.plan, self.where, over, lines, self.named("panels"), has_axis=has_axis)
        return Layout(data, self, found, metrics)

    def draw(self, data: Data, extracts: Mapping[RunKey, Any], paths: Sequence[Path]) -> str:
        """Write the figure to the files and return its caption; ``extracts`` come from repeated runs."""
        raise NotImplementedError


class SignalFigure(StudyFigure):
    """Base class of figures drawn from signals: a study keeps none, but runs can be repeated."""

    signal_parameters: ClassVar[tuple[str, ...]] = ()  # parameters with patterns of output ports

    def runs_of(self, data: Data) -> list[RunKey]:
        """The runs to be repeated."""
        raise NotImplementedError

    def ports(self, model: Model) -> tuple[str, ...]:
        """The output ports to be recorded in these runs, as patterns."""
        return tuple(pattern for parameter in self.signal_parameters for pattern in self.named(parameter))

    def extract(self, model: Model, results: Results) -> Any:
        """What it needs from one of these runs, as plain data; called in the process that made the run."""
        raise NotImplementedError

    def check_model(self, model: Model) -> Iterator[Fault]:
        """Problems of the figure in this model, except those of its signals."""
        yield from ()


def _has(dimension: Dimension, factor: str, level: Any) -> bool:
    try:
        if len(dimension.columns) == 1:
            return dimension.find({factor: level}) is not None
        return any(dimension.level(index).values[factor] == level for index in range(dimension.size))
    except (TypeError, ValueError, OverflowError):  # not a number, or not a finite one
        return False


def _listed(dimension: Dimension, factor: str) -> str:
    few = range(min(dimension.size, MAX_LISTED))
    texts = list(dict.fromkeys(shown(dimension.level(index).values[factor]) for index in few))
    return ", ".join(texts) + (", ..." if dimension.size > MAX_LISTED else "")


# -- panels and lines -------------------------------------------------------------------------------------------------


def roles(
    plan: Plan, fixed: Mapping[str, Any], over: str | None, lines: str | None, panels: Sequence[str], *, has_axis: bool
) -> Roles:
    """The role of each factor: as declared; otherwise the first numeric factor is along the axis, the next one makes
    lines, and all others make panels.  Columns that vary together count once.
    """
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
    """One panel: its conditions by the level of its lines."""

    title: str
    lines: dict[Factor, list[Condition]]


class Layout:
    """The conditions of a figure, sorted into panels and lines, and its legend.

    More than a reader can distinguish are left out; ``omitted`` states how many.
    """

    def __init__(self, data: Data, figure: StudyFigure, found: Roles, metrics: Sequence[str] = ()) -> None:
        self.roles = found
        self._metrics = metrics
        self.names = Names(data.plan, figure.labels)
        self.chosen = data.where(figure.where)
        self.levels_of = partial(data.levels, conditions=self.chosen, fixed=figure.where)
        self.handles: dict[str, Any] = {}
        levels: list[Factor] = self.levels_of(found.lines) if found.lines else [*metrics] or [None]
        choices = [self.levels_of(name) for name in found.panels]
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
            omitted.append(f"Only the first {MAX_LINES} of {len(levels)} lines are shown.")
        if len(panels) > MAX_PANELS:
            omitted.append(f"Only the first {MAX_PANELS} of {counted(len(panels), 'panel')} are shown.")
        self.omitted = " ".join(omitted)
        self.panels, self.levels = panels[:MAX_PANELS], levels[:MAX_LINES]
        self.shades = colours(len(self.levels))
        # Two factors become rows and columns.
        self.columns = len(choices[1]) if len(choices) == 2 and 1 < len(choices[1]) <= 4 else None

    def sheet(self, **look: Any) -> Sheet:
        return Sheet(**{"panels": [panel.title for panel in self.panels] or [""], "columns": self.columns, **look})

    def look(self, number: int, *, marked: bool = False) -> dict[str, Any]:
        """The style of a line; if lines are few, they differ in more than colour."""
        few = number < FEW and len(self.levels) <= FEW
        look = {"color": self.shades[number], "linestyle": DASHES[number] if few else "-"}
        return {**look, "marker": MARKERS[number] if few else "."} if marked else look

    def called(self, level: Factor) -> str:
        """The name of a line in the legend."""
        return self.names.words(str(level)) if self._metrics else self.names.level(self.roles.lines or "", level)

    def about(self, panel: Panel, level: Factor) -> str:
        """The panel and line that a tip belongs to."""
        line = self.names.place({self.roles.lines: level}) if self.roles.lines else ""
        return ", ".join(filter(None, (line, panel.title)))

    def show(self, level: Factor, handle: Any) -> None:
        """Add the line of a level to the legend."""
        if self.roles.lines or self._metrics:
            self.handles.setdefault(self.called(level), handle)

    def finish(self, sheet: Sheet, paths: Sequence[Path], *said: str) -> str:
        """Add the legend and write the files; returns the caption, including what is left out."""
        title = self.names.words(self.roles.lines) if self.roles.lines else ""
        if len(self.levels) > FEW:
            sheet.band([*map(self.called, self.levels)], self.shades, title)
        else:
            sheet.legend(list(self.handles.values()), list(self.handles), title)
        sheet.save(paths)
        return " ".join(filter(None, (*said, self.omitted)))
