"""The figures that a file declares, and everything that is wrong with them."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from collections.abc import Mapping as AnyMapping
from typing import TypeVar

from epicycle.actors import Configurable, Fault, declared_parameters, did_you_mean

from ..catalogue.figure import Figure
from ..catalogue.types import CatalogueError, figure_types
from ..language.values import Locals
from ..text.document import Mapping
from ..text.faults import blame, place_in
from ..text.kinds import UNKNOWN_TYPE
from ..text.patterns import select
from ..text.problems import Poison, Problems
from .model import DeclaredFigure, Model
from .resolve import ParameterResolver

T = TypeVar("T", bound=Configurable)


def tell_of_figure(fault: Fault, name: str, written: Mapping, problems: Problems) -> None:
    """Add a fault of a figure to the problems, at its place."""
    problems.add(f"figure {name}: {fault.message}", place_in(written, fault), *fault.help)


def made_figure(
    name: str, known: AnyMapping[str, type[T]], declared: DeclaredFigure, problems: Problems, *, of_study: bool = False
) -> T | Poison:
    """The figure declared by a type, values, and the same as written."""
    type_name, values, written = declared
    try:
        cls = known.get(type_name)
    except CatalogueError as error:
        return blame(problems, f"figure {name}", error, written.position)
    if cls is None:
        kind = f"figure {'of a study of type' if of_study else 'type'} {type_name!r}"
        message, hint = f"figure {name}: there is no {kind}", f"valid types: {', '.join(sorted(known))}"
        near = type_name, list(known)
        return problems.add(message, written.position, hint, kind=UNKNOWN_TYPE, near=near)
    where = f"figure {name}", written.position
    return ParameterResolver(problems).configured(cls, written.entries, Locals(), *where, make=cls, evaluated=values)


def figures_of(model: Model, problems: Problems, recorded: Collection[str] | None = None) -> dict[str, Figure]:
    """The figures of a model by name; what is wrong with them is added to ``problems``.

    ``recorded``: the ports of which a run keeps the signals, if not those that the model names.
    """
    # If something else is wrong, that may be why a signal is not recorded.
    kept = None if len(problems) else model.output.recorded if recorded is None else recorded
    known = figure_types()
    found: dict[str, Figure] = {}
    for name, declared in model.figures.items():
        if not (figure := made_figure(name, known, declared, problems)):
            continue
        try:
            for fault in _unrecorded(figure, kept):
                tell_of_figure(fault, name, declared[2], problems)
            found[name] = figure
        except Exception as error:  # of a user's class
            blame(problems, f"figure {name}", error, declared[2])
    return found


def _unrecorded(figure: Figure, recorded: Collection[str] | None) -> Iterator[Fault]:
    """Faults about missing signals; a pattern over an array may select nothing."""
    values = {name: getattr(figure, name) for name in declared_parameters(type(figure))}
    for pattern in figure.signal_patterns():
        if recorded is not None and not select(pattern, recorded) and "*" not in pattern:
            message = f"{pattern!r} is not recorded{did_you_mean(pattern, list(recorded))}"
            owner = (name for name, value in values.items() if pattern == value or _holds(value, pattern))
            keys = (next(owner, ""), pattern)
            yield Fault(message, keys, of_key=True, help=("add it to 'record' in the run section",))


def _holds(value: object, text: str) -> bool:
    return isinstance(value, (tuple, list, dict)) and text in value
