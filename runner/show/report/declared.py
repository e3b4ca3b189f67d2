"""Turns the ``figures`` of a study file into figures that can be drawn; provides defaults if there are none."""

from __future__ import annotations

from collections.abc import Mapping as AnyMapping
from contextlib import suppress

from epicycle.actors import Fault, UnitError, variants

from ...model.build.figures import made_figure, tell_of_figure
from ...model.catalogue.types import with_offered
from ...model.language.dimensions import in_si, split_number
from ...model.text.document import Mapping, Node, Sequence, plain
from ...model.text.faults import place_in
from ...model.text.problems import Problems
from ...study.plan.plan import Plan
from . import of_signals  # noqa: F401  whose types are known by that
from .figure import SignalFigure, StudyFigure
from .of_table import CURVES, Distributions, Means


def own_study_figures() -> dict[str, type[StudyFigure]]:
    """The study figures defined by Epicycle and the running program, by name."""
    known: dict[str, type[StudyFigure]] = variants(StudyFigure)
    return dict(sorted((name, cls) for name, cls in known.items() if cls.draw is not StudyFigure.draw))


def study_figure_types() -> AnyMapping[str, type[StudyFigure]]:
    """The figures that a study may use, by name."""
    return with_offered(StudyFigure, "epicycle.study_figures", own_study_figures())


def check_figures(plan: Plan) -> None:
    """Raise ``ModelError`` with all problems of a study's figures; loads its model if they need it."""
    problems = Problems()
    found = figures_of_study(plan, problems)
    drawn = {name: figure for name, figure in found.items() if isinstance(figure, SignalFigure)}
    # One condition may have something, such as a second robot, that another lacks.
    models = [plan.load(plan.condition(index)) for index in sorted({0, plan.conditions - 1})] if drawn else []
    for name, figure in drawn.items():
        part = (plan.study.figures or {})[name]
        written = Mapping(part.values, part.type.position)
        complaint = next(figure.check_model(models[0]), None)
        if complaint is not None:
            tell_of_figure(complaint, name, written, problems)
            continue
        patterns = [(key, pattern) for key in figure.signal_parameters for pattern in figure.named(key)]
        for key, pattern in patterns:
            position = place_in(written, Fault("", (key, pattern), of_key=True))
            tried = [Problems() for _ in models]
            for model, told in zip(models, tried, strict=True):
                model.outputs(pattern, f"figure {name}", position, told)
            if all(len(told) for told in tried):
                for problem in tried[0].found:
                    problems.add(problem.message, problem.position, *problem.help)
    problems.raise_if_any()


def figures_of_study(plan: Plan, problems: Problems) -> dict[str, StudyFigure]:
    """The figures of a study by name; adds their problems to ``problems``."""
    if plan.study.figures is None:
        return default_figures(plan)
    known = study_figure_types()
    found: dict[str, StudyFigure] = {}
    for name, part in plan.study.figures.items():
        written = Mapping(part.values, part.type.position)
        values = {key: plain(entry.value) for key, entry in part.values.items()}
        if "where" in part.values and isinstance(where := part.values["where"].value, Mapping):
            values["where"] = {factor: _levels(entry.value, plan, factor) for factor, entry in where.entries.items()}
        figure = made_figure(name, known, (part.type.text, values, written), problems, of_study=True)
        if figure:
            found[name] = figure
            for complaint in figure.complaints(plan):
                tell_of_figure(complaint, name, written, problems)
    return found


def _levels(node: Node, plan: Plan, factor: str) -> object:
    """A level or a list of levels, as in the table: with a unit, in SI units."""
    if isinstance(node, Sequence):
        return [_levels(item, plan, factor) for item in node.items]
    parts = split_number(node) if plan.study.factors.get(factor) in ("int", "float") else None
    with suppress(UnitError):
        if parts is not None and parts[1]:
            return in_si(float(parts[0]), parts[1])
    return plain(node)


def default_figures(plan: Plan) -> dict[str, StudyFigure]:
    """For every metric, the mean over the factors and the distribution.

    For points in a box (a Latin hypercube), there is a figure for each side of it and no distribution, because each
    point has its own runs.
    """
    dimensions = plan.study.dimensions
    boxes = [each for each in dimensions if len(each.columns) > 1 and set(each.columns.values()) <= {"int", "float"}]
    found: dict[str, StudyFigure] = {}
    for metric in plan.metrics:
        about = plan.columns.get(metric.name)
        given = {"doc": about.doc} if about is not None else {}
        for number, column in enumerate((column for box in boxes for column in box.columns), start=1):
            found[f"{metric.name}_mean_{number}"] = Means(metric=metric.name, over=column, **given)
        if dimensions and not boxes:
            found[f"{metric.name}_mean"] = Means(metric=metric.name, **given)
            found[f"{metric.name}_runs"] = Distributions(metrics=metric.name)
        elif not dimensions:
            found[f"{metric.name}_runs"] = Distributions(metrics=metric.name, style=CURVES, **given)
    return found
