"""The options that several commands share, and what they mean."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..printing import complain, complain_traceback

if TYPE_CHECKING:
    from epicycle.actors import EpicycleError

    from ..build import Model

DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130


def add_model(command: argparse.ArgumentParser) -> None:
    """The options that say which model is meant, and what to change in it."""
    command.add_argument("model", metavar="MODEL", help="a path to a YAML file, or the name of a packaged model")
    add_changes(command)


def add_changes(command: argparse.ArgumentParser) -> None:
    """The options that change a model."""
    add_several(
        command,
        "--set",
        "PATH=VALUE",
        "set a parameter, such as observers=3 or 'observer[*].sensor.max_range=5 m'; may be repeated",
    )
    add_several(
        command,
        "--overrides",
        "FILE",
        "set what a YAML file of lines like 'observer[*].sensor.max_range: 5 m' says; --set wins over it",
    )
    add_several(
        command,
        "--disturb",
        "NAME or FILE",
        "add the aspects of a packaged disturbance or of a YAML file; may be repeated; "
        "--aspect and --without count after it",
    )
    add_several(
        command,
        "--aspect",
        "NAME=TYPE,KEY=VALUE,...",
        "add an aspect, or put it in the place of the one of that name; may be repeated",
    )
    add_several(command, "--without", "NAME", "remove an aspect; may be repeated")
    command.add_argument(
        "--max-actors",
        metavar="N",
        type=whole(1, 10**9 - 1),
        help="how many actors and composites are not taken for a mistake, and a fifth of how many connections "
        "(default: 20,000)",
    )
    add_types(command)


def add_several(command: argparse.ArgumentParser, flag: str, metavar: str, about: str) -> None:
    """An option that may be given more than once, with a value each time."""
    command.add_argument(flag, metavar=metavar, action="append", default=[], help=about)


def add_types(command: argparse.ArgumentParser) -> None:
    """The option that makes types of the user's own known."""
    about = "a Python file with actors and aspects of your own, whose code is run; may be repeated"
    add_several(command, "--types", "FILE", about)


def own_types(options: argparse.Namespace) -> list[type]:
    """The types of the files that ``--types`` names."""
    from ..catalogue import types_of_file

    return [each for file in options.types for each in types_of_file(Path(file))]


def whole(first: int, last: int | None = None, most: str = "") -> Callable[[str], int]:
    """What reads a whole number, up to ``last``, which is written as ``most``."""

    def read(text: str) -> int:
        number = int(text) if text.isdecimal() and len(text) <= 20 else -1
        if number < first or (last is not None and number > last):
            end = "on" if last is None else f"to {most or last}"
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from {first} {end}")
        return number

    return read


count = whole(1, 10**9, "1e9")


def seed(text: str, last: int | None = None) -> int:
    """A seed: a whole number from 0 on, and up to ``last`` where others follow it."""
    from ..text import MAX_SEED

    return whole(0, MAX_SEED if last is None else last)(text)


def positive_seconds(text: str) -> float:
    """A number of seconds of real time."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not 0.0 < number < math.inf:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of seconds greater than 0")
    return number


def seconds(option: str, text: str) -> float:
    """A model time that an option gives, in seconds or with a unit."""
    from epicycle.actors import EpicycleError, convert

    time = convert(text, "s")
    if not 0.0 <= time < 1e9:
        raise EpicycleError(f"{option} {text}: expected a time from 0 s to 1e9 s")
    return time


def complain_of(errors: Sequence[EpicycleError], options: argparse.Namespace) -> int:
    """Say what went wrong after a run; the exit code."""
    for error in errors:
        if options.debug:
            complain_traceback(error)
        complain(f"error: {error}")
    return FAILED if errors else DONE


def load(options: argparse.Namespace, *, strict: bool = False) -> Model:
    """The model that the options describe; warnings are printed, or with ``strict`` raised."""
    from ..build import load_model
    from ..text import ModelError

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
    if not strict:
        for warning in model.warnings:
            complain(str(warning))
    elif model.warnings:
        raise ModelError(replace(warning, severity="error") for warning in model.warnings)
    return model
