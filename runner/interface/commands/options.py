"""What a command is, and what several commands share."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Collection, Sequence
from functools import partial
from operator import methodcaller
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ...support.declare.commands import add_options, arguments
from ...support.printing import complain, complain_traceback
from ..calls import running

if TYPE_CHECKING:
    from epicycle.actors import EpicycleError

    from ...model.build.model import Model
    from ...study.run_spec import OpenedRun

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
    return lambda run: Command(run.__name__.rstrip("_"), summary, run.__doc__, options, imports, run)


def of_call(
    call: Callable[..., Any], *options: Option, first: tuple[Option, ...] = (), imports: tuple[str, ...]
) -> Callable[[Run], Command]:
    """Turn a function into a command with the name, the words and the options of a call, and some more of these.

    What the call says of itself, without the examples, describes the command; its first sentence is the summary.
    """
    text = (call.__doc__ or "").partition(">>>")[0].strip()
    sentence = " ".join(text.partition("\n\n")[0].split()).removesuffix(".")
    summary = sentence[0].lower() + sentence[1:]
    given = (*first, taken(call), *options)
    return lambda run: Command(call.__name__.replace("_", "-"), summary, text, given, imports, run)


def taken(call: Callable[..., Any], *, without: Collection[str] = (), only: Collection[str] = ()) -> Option:
    """The options of a call."""
    return lambda parser: add_options(parser, call, without=without, only=only)


TYPES = taken(running.load, only={"types"})
JSON = option("--json", action="store_true", help="print one JSON object instead of the text")


def own_types(options: argparse.Namespace) -> list[type]:
    """The types of the files that ``--types`` names."""
    from ..calls.changes import classes

    return classes(getattr(options, "types", ()))


def open_run(options: argparse.Namespace, call: Callable[..., Any], model: str) -> OpenedRun:
    """The run that the options of a call describe, and a model, a folder or a run of a study; warnings are printed."""
    from ...study.run_spec import RunSpec, opened

    given = arguments(call, options)
    run = opened(RunSpec.of(model, given.get("seed"), given.get("until"), given))
    for warning in run.model.warnings:
        complain(str(warning))
    return run


def complain_of_change(name: str, before: str, digest: str) -> bool:
    """Say so if a run that was made again is not the same; whether it is not."""
    if has_changed := bool(before) and before != digest:
        complain(f"{name} was made by another version of the model or of Epicycle: the run is no longer the same")
    return has_changed


def load(options: argparse.Namespace, *, strict: bool = False) -> Model:
    """The model that the options describe; warnings are printed or, with ``strict``, raised."""
    from ...model.text.problems import ModelError

    model = running.load(**arguments(running.load, options))
    if strict and model.warnings:
        from dataclasses import replace

        raise ModelError(replace(warning, severity="error") for warning in model.warnings)
    for warning in model.warnings:
        complain(str(warning))
    return model


def check_path(flag: str, path: Path | None) -> None:
    """Raise ``EpicycleError`` if a file, where one is asked for, cannot be written, before a run is made for it."""
    from epicycle.actors import EpicycleError

    if path is None:
        return
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
