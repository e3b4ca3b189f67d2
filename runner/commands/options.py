"""What a command is, and the options that several commands share, with their meaning."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Sequence
from functools import partial
from operator import methodcaller
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ..printing import complain, complain_traceback

if TYPE_CHECKING:
    from epicycle.actors import EpicycleError

    from ..build.model import Model
    from ..calls import OpenedRun, RunSpec

DONE, FAILED, BAD_INPUT, BROKEN, INTERRUPTED = 0, 1, 2, 3, 130

Option = Callable[[argparse.ArgumentParser], object]
Run = Callable[[argparse.Namespace], int]

option: Callable[..., Option] = partial(methodcaller, "add_argument")  # an option or argument for argparse
several: Callable[..., Option] = partial(
    option, action="append", default=[]
)  # an option that takes a value each time it is given


class Command(NamedTuple):
    """A command: its name, its texts in ``epicycle --help`` and its own ``--help``, its options, and its function.

    ``run`` returns the exit code.  Nothing heavy is imported before it runs, so that ``--help`` answers at once;
    ``imports`` are the packages that it always needs.
    """

    name: str
    summary: str
    description: str | None
    options: tuple[Option, ...]
    imports: tuple[str, ...]
    run: Run


def command(summary: str, *options: Option, imports: tuple[str, ...]) -> Callable[[Run], Command]:
    """Turn a function into a command with its name, described by its docstring."""
    return lambda run: Command(run.__name__, summary, run.__doc__, options, imports, run)


# -- values of options ------------------------------------------------------------------------------------------------


def whole(first: int, last: int | None = None, most: str = "") -> Callable[[str], int]:
    """A reader of whole numbers up to ``last``, which messages show as ``most``."""

    def read(text: str) -> int:
        number = int(text) if text.isdecimal() and len(text) <= 20 else -1
        if number < first or (last is not None and number > last):
            bounds = f"of at least {first}" if last is None else f"from {first} to {most or last}"
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number {bounds}")
        return number

    return read


def seed(text: str) -> int:
    """A seed: a whole number of at least 0."""
    from ..text.limits import MAX_SEED

    return whole(0, MAX_SEED)(text)


def first_seed(text: str) -> int:
    """A first seed such that the seeds of all replications are valid, too."""
    from ..language.study import MAX_STUDY_SEED

    return whole(0, MAX_STUDY_SEED)(text)


def number(text: str) -> float:
    """The number that a text represents; NaN if it represents none."""
    try:
        return float(text)
    except ValueError:
        return math.nan


def positive_seconds(text: str) -> float:
    """A number of seconds of wall-clock time."""
    if not 0.0 < (found := number(text)) < math.inf:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of seconds greater than 0")
    return found


# -- options ----------------------------------------------------------------------------------------------------------

COUNT = whole(1, 10**9, "1e9")
SEED = option("--seed", type=seed, metavar="N", help="seed of all random streams (default: the model's)")
UNTIL = option("--until", metavar="TIME", help="stop time, such as 30 or '500 ms' (default: the model's)")
JOBS = option("--jobs", type=COUNT, metavar="N", help="processes at a time (default: one per core)")
RUN_TIMEOUT = option(
    "--run-timeout",
    type=positive_seconds,
    metavar="S",
    help="seconds of wall-clock time after which a run is ended and counts as failed (default: no limit)",
)
JSON = option("--json", action="store_true", help="print JSON")
TYPES = several(
    "--types",
    metavar="FILE",
    help="a Python file with your own actors and aspects, whose code is run; may be repeated",
)
DISTURB = several(
    "--disturb",
    metavar="NAME or FILE",
    help="add the aspects of a packaged disturbance or of a YAML file; may be repeated",
)
ASPECTS = (
    several(
        "--aspect",
        metavar="NAME=TYPE,KEY=VALUE,...",
        help="add an aspect, or replace the one with that name, after --disturb; may be repeated",
    ),
    several("--without", metavar="NAME", help="remove an aspect, after --disturb; may be repeated"),
)
CHANGES = (  # to a model
    several(
        "--set",
        metavar="PATH=VALUE",
        help="set a parameter, such as observers=3 or 'observer[*].sensor.max_range=5 m'; may be repeated",
    ),
    several(
        "--overrides",
        metavar="FILE",
        help="set parameters from a YAML file of lines such as 'observer[*].sensor.max_range: 5 m'; --set wins",
    ),
    DISTURB,
    *ASPECTS,
    option(
        "--max-actors",
        metavar="N",
        type=whole(1, 10**9 - 1),
        help="limit for actors and composites, and a fifth of the limit for connections (default: 20,000)",
    ),
    TYPES,
)
RUN = "a model, the results folder of a run, or a run of a study, such as results/table_1/3f9a0c"
MODEL = (option("model", metavar="MODEL", help="a path to a YAML file, or the name of a packaged model"), *CHANGES)


def own_types(options: argparse.Namespace) -> list[type]:
    """The types of the files that ``--types`` names."""
    from ..catalogue.types import types_of_file

    return [each for file in options.types for each in types_of_file(Path(file))]


def spec_of(options: argparse.Namespace) -> RunSpec:
    """The run that the options describe."""
    from ..calls import RunSpec

    return RunSpec(
        options.model,
        set=tuple(options.set),
        overrides=tuple(options.overrides),
        disturb=tuple(options.disturb),
        aspects=tuple(options.aspect),
        without_aspects=tuple(options.without),
        types=tuple(options.types),
        max_actors=options.max_actors,
        seed=options.seed,
        until=getattr(options, "until", None),
    )


def open_run(options: argparse.Namespace) -> OpenedRun:
    """The run that the options describe, whose model they may name by a results folder; warnings are printed."""
    from ..calls import opened

    run = opened(spec_of(options))
    for warning in run.model.warnings:
        complain(str(warning))
    return run


def complain_of_change(name: str, before: str, digest: str) -> None:
    """Say so if a run that was made again is not the same."""
    if before and before != digest:
        complain(f"{name} was made by another version of the model or of Epicycle: the run is no longer the same")


def load(options: argparse.Namespace, *, strict: bool = False) -> Model:
    """The model that the options describe; warnings are printed or, with ``strict``, raised."""
    from ..build.load import load_model
    from ..text.problems import ModelError

    model = load_model(
        options.model,
        set=options.set,
        overrides=options.overrides,
        disturb=options.disturb,
        aspects=options.aspect,
        without_aspects=options.without,
        types=own_types(options),
        **({} if options.max_actors is None else {"max_actors": options.max_actors}),
    )
    if strict and model.warnings:
        from dataclasses import replace

        raise ModelError(replace(warning, severity="error") for warning in model.warnings)
    for warning in model.warnings:
        complain(str(warning))
    return model


def check_path(flag: str, path: Path) -> None:
    """Raise ``EpicycleError`` if the file cannot be written, before a run is made for it."""
    from epicycle.actors import EpicycleError

    if not path.parent.is_dir():
        raise EpicycleError(f"{flag} {path} cannot be written: there is no folder {path.parent}")
    if path.is_dir():
        raise EpicycleError(f"{flag} {path} cannot be written: it is a folder")


def complain_of(errors: Sequence[EpicycleError], options: argparse.Namespace) -> int:
    """Report what went wrong after a run; the exit code."""
    for error in errors:
        if options.debug:
            complain_traceback(error)
        complain(f"error: {error}")
    return FAILED if errors else DONE
