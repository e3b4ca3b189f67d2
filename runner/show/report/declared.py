"""From the ``figures`` of a study file to figures that can be drawn; those of a study that names none."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

from epicycle.actors import ParameterError, UnitError, declared_parameters, did_you_mean, unknown_parameter, variants

from ...language import PartText, in_si, split_number
from ...model import Model
from ...study import Plan
from ...text import Mapping, ModelError, Node, Position, Problems, Sequence, plain
from .figure import Complaint, SignalFigure, StudyFigure
from .of_signals import Series, SingleRun, Tracks
from .of_table import CURVES, Distributions, Means

__all__ = [
    "Distributions",
    "Means",
    "Series",
    "SingleRun",
    "Tracks",
    "check_figures",
    "default_figures",
    "figures_of_study",
    "study_figure_types",
]


def study_figure_types() -> dict[str, type[StudyFigure]]:
    """The figures that a study may ask for, by name."""
    known: dict[str, type[StudyFigure]] = variants(StudyFigure)
    return dict(sorted((name, cls) for name, cls in known.items() if cls.draw is not StudyFigure.draw))


def check_figures(plan: Plan) -> None:
    """Raise ``ModelError`` with all that is wrong with the figures of a study; its model is loaded if they need it."""
    problems = Problems()
    found = figures_of_study(plan, problems)
    declared = plan.study.figures or {}
    drawn = {name: figure for name, figure in found.items() if isinstance(figure, SignalFigure)}
    # What one condition has, such as a second robot, another one may lack.
    models = [plan.load(plan.condition(index)) for index in sorted({0, plan.conditions - 1})] if drawn else []
    for name, figure in drawn.items():
        for complaint in _complaints_of_models(figure, models):
            _add(complaint, name, declared[name], problems)
    problems.raise_if_any()


def figures_of_study(plan: Plan, problems: Problems) -> dict[str, StudyFigure]:
    """The figures of a study by name; what is wrong with them is added to ``problems``."""
    if plan.study.figures is None:
        return default_figures(plan)
    known = study_figure_types()
    found: dict[str, StudyFigure] = {}
    for name, part in plan.study.figures.items():
        cls = known.get(part.type.text)
        if cls is None:
            problems.add(
                f"figure {name}: there is no figure of a study of type {part.type.text!r}"
                f"{did_you_mean(part.type.text, list(known))}",
                part.type.position,
                f"valid types: {', '.join(known)}",
            )
        elif (figure := _made(name, cls, part, plan, problems)) is not None:
            found[name] = figure
            for complaint in figure.complaints(plan):
                _add(complaint, name, part, problems)
    return found


def _made(name: str, cls: type[StudyFigure], part: PartText, plan: Plan, problems: Problems) -> StudyFigure | None:
    """The figure with its parameters; all that are wrong are told."""
    before = len(problems)
    declared = declared_parameters(cls)
    values = {}
    for key, entry in part.values.items():
        if key not in declared:
            problems.add(
                f"figure {name}: {unknown_parameter(cls, key)}",
                entry.key.position,
                f"valid parameters: {', '.join(declared)}",
            )
            continue
        values[key] = plain(entry.value)
        try:
            declared[key].convert(values[key])
        except ParameterError as error:
            problems.add(f"figure {name}: {key}: {error}", entry.value.position)
    if "where" in part.values and isinstance(where := part.values["where"].value, Mapping):
        values["where"] = {factor: _levels(entry.value, plan, factor) for factor, entry in where.entries.items()}
    for key, parameter in declared.items():
        if parameter.required and key not in part.values and part.values.keys() <= declared.keys():
            problems.add(f"figure {name}: {cls.__name__} needs a value for {key!r}", part.type.position, parameter.doc)
    return cls(**values) if len(problems) == before else None


def _levels(node: Node, plan: Plan, factor: str) -> object:
    """A level or a list of them, as the table holds them: what has a unit is counted in SI units."""
    if isinstance(node, Sequence):
        return [_levels(item, plan, factor) for item in node.items]
    parts = split_number(node) if plan.study.factors.get(factor) in ("int", "float") else None
    with suppress(UnitError):
        if parts is not None and parts[1]:
            return in_si(float(parts[0]), parts[1])
    return plain(node)


def _complaints_of_models(figure: SignalFigure, models: list[Model]) -> Iterator[Complaint]:
    """What is wrong with a figure in all of the models."""
    for complaint in figure.check_model(models[0]):
        yield complaint
        return
    parameters = ("signal", "signals", "around")
    said = [(key, pattern) for key in parameters for pattern in _texts(getattr(figure, key, ()))]
    for key, pattern in said:
        errors = [error for model in models if (error := _not_recorded(model, pattern)) is not None]
        if len(errors) == len(models):
            problem = errors[0].problems[0]
            advice = problem.help[0] if problem.help else ""
            yield Complaint(key, problem.message.removeprefix("record: "), advice, pattern)


def _texts(value: object) -> tuple[str, ...]:
    return (value,) if isinstance(value, str) else tuple(value)  # type: ignore[arg-type]


def _not_recorded(model: Model, pattern: str) -> ModelError | None:
    before = list(model.recorded)
    try:
        model.record(pattern)
    except ModelError as error:
        return error
    finally:
        model.recorded = before
    return None


def _add(complaint: Complaint, name: str, part: PartText, problems: Problems) -> None:
    """Tell it where the value stands, or the one name in it that it is about."""
    entry = part.values.get(complaint.parameter)
    position: Position = part.type.position if entry is None else entry.value.position
    if entry is not None and isinstance(entry.value, Mapping) and (inner := entry.value.entries.get(complaint.key)):
        position = inner.key.position
    elif entry is not None and isinstance(entry.value, Sequence):
        found = (item for item in entry.value.items if plain(item) == complaint.key)
        position = next(found, entry.value).position
    problems.add(f"figure {name}: {complaint.message}", position, *([complaint.help] if complaint.help else []))


def default_figures(plan: Plan) -> dict[str, StudyFigure]:
    """Of every metric the mean over what was varied, and the distribution.

    Of points in a box (a Latin hypercube) there is a figure for each side of it, and no distribution: each point has
    runs of its own.
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
