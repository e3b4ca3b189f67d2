"""The figures that a file declares, and everything that is wrong with them."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from collections.abc import Mapping as AnyMapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TypeVar

from epicycle.actors import Configurable, ParameterError, declared_parameters, unknown_parameter

from ..catalogue import CatalogueError, Figure, figure_types
from ..text import Mapping, PatternError, Position, Problems, Sequence, describe, did_you_mean, plain, raised_at, select
from .model import DeclaredFigure, Model
from .settle import place_of

T = TypeVar("T", bound=Configurable)


@dataclass(frozen=True)
class Complaint:
    """A problem of a figure: the parameter (any, if empty) and the ``key`` in it, the message, and what to do."""

    parameter: str
    message: str
    help: str = ""
    key: str = ""


def tell_of_figure(complaint: Complaint, name: str, written: Mapping, problems: Problems) -> None:
    """Add a complaint to the problems, at the place that it concerns."""
    message = f"figure {name}: {complaint.message}"
    problems.add(message, place_in_figure(complaint, written), *([complaint.help] if complaint.help else []))


def place_in_figure(complaint: Complaint, written: Mapping) -> Position:
    """The position of the value, or of the one name in it."""
    entry = written.entries.get(complaint.parameter)
    for each in [entry] if entry is not None else [] if complaint.parameter else written.entries.values():
        if isinstance(each.value, Mapping) and complaint.key in each.value.entries:
            return each.value.entries[complaint.key].key.position
        for item in each.value.items if isinstance(each.value, Sequence) else [each.value]:
            if complaint.key and plain(item) == complaint.key:
                return item.position
    return written.position if entry is None else entry.value.position


def made_figure(
    name: str, known: AnyMapping[str, type[T]], declared: DeclaredFigure, problems: Problems, *, of_study: bool = False
) -> T | None:
    """The figure declared by a type, values, and the same as written; None, and problems, if it cannot be made."""
    type_name, values, written = declared
    before = len(problems)
    try:
        cls = known.get(type_name)
    except CatalogueError as error:
        problems.add(f"figure {name}: {error.message}", written.position, *error.help)
        return None
    if cls is None:
        kind = f"figure {'of a study of type' if of_study else 'type'} {type_name!r}"
        message = f"figure {name}: there is no {kind}{did_you_mean(type_name, list(known))}"
        problems.add(message, written.position, f"valid types: {', '.join(sorted(known))}")
        return None
    parameters, owner = declared_parameters(cls), "" if of_study else f"{cls.__name__}."
    for key, value in values.items():
        if key not in parameters:
            place = place_of(written, (key,), of_key=True)
            valid = f"valid parameters: {', '.join(parameters)}"
            problems.add(f"figure {name}: {unknown_parameter(cls, key)}", place, valid)
            continue
        try:
            parameters[key].convert(value)
        except ParameterError as error:
            place = place_of(written, (key, *error.keys), of_key=error.of_key)
            problems.add(f"figure {name}: {owner}{key}: {error}", place)
    for key, parameter in parameters.items():
        if parameter.required and key not in values and values.keys() <= parameters.keys():
            advice = [parameter.doc] if of_study else []
            problems.add(f"figure {name}: {cls.__name__} needs a value for {key!r}", written.position, *advice)
    figure = None
    if len(problems) == before:
        with _blamed(name, written, problems):
            figure = cls(**values)
    return figure


@contextmanager
def _blamed(name: str, written: Mapping, problems: Problems) -> Iterator[None]:
    """Add what a figure's class raises to the problems."""
    try:
        yield
    except ParameterError as error:
        problems.add(f"figure {name}: {error}", place_of(written, error.keys, of_key=error.of_key))
    except PatternError as error:
        problems.add(f"figure {name}: {error}", written.position)
    except Exception as error:  # of a user's class
        problems.add(f"figure {name}: {describe(error)}", written.position, raised=raised_at(error), cause=error)


def figures_of(model: Model, problems: Problems, recorded: Collection[str] | None = None) -> dict[str, Figure]:
    """The figures of a model by name; what is wrong with them is added to ``problems``.

    ``recorded``: the ports of which a run keeps the signals, if not those that the model names.
    """
    # If something else is wrong, that may be why a signal is not recorded.
    kept = None if len(problems) else model.recorded if recorded is None else recorded
    known = figure_types()
    found: dict[str, Figure] = {}
    for name, declared in model.figures.items():
        figure = made_figure(name, known, declared, problems)
        if figure is not None:
            with _blamed(name, declared[2], problems):
                for complaint in _unrecorded(figure, kept):
                    tell_of_figure(complaint, name, declared[2], problems)
                found[name] = figure
    return found


def _unrecorded(figure: Figure, recorded: Collection[str] | None) -> Iterator[Complaint]:
    """Complaints about missing signals; a pattern over an array may select nothing."""
    for pattern in figure.signal_patterns():
        if recorded is not None and not select(pattern, recorded) and "*" not in pattern:
            message = f"{pattern!r} is not recorded{did_you_mean(pattern, list(recorded))}"
            yield Complaint("", message, "add it to 'record' in the run section", pattern)
