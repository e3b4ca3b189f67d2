"""From a model's ``figures`` section to figures that can be drawn, and to what is drawn."""

from __future__ import annotations

from pathlib import Path

from epicycle.actors import EpicycleError, ParameterError, declared_parameters, readable, unknown_parameter, variants

from ..engine import Results
from ..model import Model, Position, Problems, describe, did_you_mean, raised_at, told_raised
from ..model.settle import place_of
from ..text import Mapping, PatternError, Sequence, plain, select
from .canvas import plain_text
from .figures import Figure


class FigureError(EpicycleError):
    """A figure cannot be drawn; ``raised`` is the line of a user's class from which the exception comes."""

    def __init__(self, name: str, reason: str, raised: Position | None = None) -> None:
        super().__init__(name, reason, raised)
        self.name = name
        self.reason = reason
        self.raised = raised

    def __str__(self) -> str:
        lines = [readable(f"figure {self.name} cannot be drawn: {self.reason}")]
        return "\n".join([*lines, *(told_raised(self.raised) if self.raised is not None else [])])


def draw(name: str, figure: Figure, results: Results, path: Path) -> None:
    """Draw a figure into a file; raises ``FigureError`` for whatever its class raises."""
    try:
        with plain_text():
            figure.draw(results, path)
    except Exception as error:
        raise FigureError(name, describe(error), raised_at(error)) from error


def figures_of(model: Model, problems: Problems) -> dict[str, Figure]:
    """The figures of a model by name; what is wrong with them is added to ``problems``."""
    known = variants(Figure)
    is_sound = not len(problems)  # else a signal may not be recorded because it is wrong
    found: dict[str, Figure] = {}
    for name, (type_name, values, written) in model.figures.items():
        cls = known.get(type_name)
        if cls is None:
            problems.add(
                f"figure {name}: there is no figure type {type_name!r}{did_you_mean(type_name, list(known))}",
                written.position,
                f"valid types: {', '.join(sorted(known))}",
            )
            continue
        before, declared = len(problems), declared_parameters(cls)
        for key, value in values.items():
            if key not in declared:
                problems.add(
                    f"figure {name}: {unknown_parameter(cls, key)}",
                    place_of(written, (key,), of_key=True),
                    f"valid parameters: {', '.join(declared)}",
                )
                continue
            try:
                declared[key].convert(value)
            except ParameterError as error:
                place = place_of(written, (key, *error.keys), of_key=error.of_key)
                problems.add(f"figure {name}: {cls.__name__}.{key}: {error}", place)
        if len(problems) > before:
            continue
        try:
            figure: Figure = cls(**values)
            for pattern in figure.signal_patterns():
                # A pattern over an array may rightly select nothing, a plain name may not.
                if is_sound and not select(pattern, model.recorded) and "*" not in pattern:
                    problems.add(
                        f"figure {name}: {pattern!r} is not recorded{did_you_mean(pattern, list(model.recorded))}",
                        _place_of_pattern(pattern, written),
                        "add it to 'record' in the run section",
                    )
        except ParameterError as error:
            problems.add(f"figure {name}: {error}", place_of(written, error.keys, of_key=error.of_key))
            continue
        except PatternError as error:
            problems.add(f"figure {name}: {error}", written.position)
            continue
        except Exception as error:  # of a class of a user's
            told = f"figure {name}: {describe(error)}"
            problems.add(told, written.position, raised=raised_at(error), cause=error)
            continue
        found[name] = figure
    return found


def _place_of_pattern(pattern: str, written: Mapping) -> Position:
    """Where a figure asks for signals."""
    values = [entry.value for entry in written.entries.values()]
    texts = (each for value in values for each in (value.items if isinstance(value, Sequence) else [value]))
    return next((each.position for each in texts if plain(each) == pattern), written.position)
