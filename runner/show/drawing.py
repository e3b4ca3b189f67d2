"""From a model's ``figures`` section to figures that can be drawn."""

from __future__ import annotations

from epicycle.actors import ParameterError, declared_parameters, unknown_parameter, variants

from ..model import Model, Problems, did_you_mean
from ..model.patterns import PatternError, select
from .figures import Figure


def figures_of(model: Model, problems: Problems) -> dict[str, Figure]:
    """The figures of a model by name; what is wrong with them is added to ``problems``."""
    known = variants(Figure)
    found: dict[str, Figure] = {}
    for name, (type_name, values, position) in model.figures.items():
        cls = known.get(type_name)
        if cls is None:
            problems.add(
                f"figure {name}: there is no figure type {type_name!r}{did_you_mean(type_name, list(known))}",
                position,
                f"valid types: {', '.join(sorted(known))}",
            )
            continue
        unknown = [key for key in values if key not in declared_parameters(cls)]
        for key in unknown:
            problems.add(
                f"figure {name}: {unknown_parameter(cls, key)}",
                position,
                f"valid parameters: {', '.join(declared_parameters(cls))}",
            )
        if unknown:
            continue
        try:
            figure: Figure = cls(**values)
            for pattern in figure.signal_patterns():
                # A pattern over an array may rightly select nothing, a plain name may not.
                if not select(pattern, model.recorded) and "*" not in pattern:
                    problems.add(
                        f"figure {name}: {pattern!r} is not recorded{did_you_mean(pattern, list(model.recorded))}",
                        position,
                        "add it to 'record' in the run section",
                    )
        except (ParameterError, PatternError) as error:
            problems.add(f"figure {name}: {error}", position)
            continue
        found[name] = figure
    return found
