"""What several calls take: changes to a model, seeds, times, processes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypedDict

from ...support.declare.parameters import COUNT, option, positive_seconds, repeated, whole

if TYPE_CHECKING:
    from ...model.language.settings import Setting


def seed(text: str) -> int:
    """A seed: a whole number of at least 0."""
    from ...model.text.limits import MAX_SEED

    return whole(0, MAX_SEED)(text)


def first_seed(text: str) -> int:
    """A first seed such that the seeds of all replications are valid, too."""
    from ...model.language.study import MAX_STUDY_SEED

    return whole(0, MAX_STUDY_SEED)(text)


SET = repeated("set a parameter, such as observers=3 or 'observer[*].sensor.max_range=5 m'", "PATH=VALUE")
DISTURB = repeated("add the aspects of a packaged disturbance or of a YAML file", "NAME or FILE")
ASPECTS = repeated(
    "add an aspect, or replace the one with that name, after --disturb", "NAME=TYPE,KEY=VALUE,...", flag="--aspect"
)
WITHOUT = repeated("remove an aspect, after --disturb", "NAME", flag="--without")
TYPES = repeated("a Python file with your own actors and aspects, or an FMU, whose code is run", "FILE")
SEED = option("seed of all random streams (default: the model's)", "N", seed)
UNTIL = option("stop time, such as 30 or '500 ms' (default: the model's)", "TIME")
JOBS = option("processes at a time (default: one per core)", "N", COUNT)
RUN_TIMEOUT = option(
    "seconds of wall-clock time after which a run is ended and counts as failed (default: no limit)",
    "S",
    positive_seconds,
)
NAME_OR_PROPERTY = "NAME or PROPERTY"


class Changes(TypedDict, total=False):
    """What ``load`` changes in a model."""

    set: Annotated[Iterable[str | Setting] | Mapping[str, object], SET]
    overrides: Annotated[
        str | Path | Iterable[str | Path],
        repeated(
            "set parameters from a YAML file of lines such as 'observer[*].sensor.max_range: 5 m'; --set wins", "FILE"
        ),
    ]
    disturb: Annotated[str | Path | Iterable[str | Path], DISTURB]
    aspects: Annotated[Iterable[str], ASPECTS]
    without_aspects: Annotated[Iterable[str], WITHOUT]
    max_actors: Annotated[
        int,
        option(
            "limit for actors and composites, and a fifth of the limit for connections (default: 20,000)",
            "N",
            whole(1, 10**9 - 1),
        ),
    ]
    types: Annotated[Iterable[type | str | Path], TYPES]


def classes(types: Iterable[type | str | Path]) -> list[type]:
    """Classes, and those that files define."""
    from ...model.catalogue.types import types_of_file

    return [each for one in types for each in ([one] if isinstance(one, type) else types_of_file(Path(one)))]
