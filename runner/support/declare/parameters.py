"""What a call says of a parameter besides its type and default, and readers of what a command line gives for it."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Option:
    """A parameter on the command line: ``parameter: Annotated[int, option("what it is", "N", whole(1))] = 5``.

    The flag is the parameter's name, unless ``flag`` gives another.  ``read`` makes a value of a text, ``once`` is
    false for what may be repeated, and ``bare`` is the value of a flag that nothing follows.
    """

    help: str
    metavar: str | None = None
    read: Callable[[str], object] = str
    flag: str = ""
    choices: tuple[str, ...] | None = None
    once: bool = True
    bare: object = None
    is_argument: bool = False  # it has no flag
    count: str | None = None  # of an argument, as argparse has it


def option(
    help: str,
    metavar: str | None = None,
    read: Callable[[str], object] = str,
    *,
    flag: str = "",
    choices: tuple[str, ...] | None = None,
    bare: object = None,
) -> Option:
    """One that is given at most once."""
    return Option(help=help, metavar=metavar, read=read, flag=flag, choices=choices, bare=bare)


def repeated(help: str, metavar: str, *, flag: str = "") -> Option:
    """One that takes a value each time it is given."""
    return Option(help=f"{help}; may be repeated", metavar=metavar, flag=flag, once=False)


def argument(help: str, metavar: str, count: str | None = None) -> Option:
    """One without a flag."""
    return Option(help=help, metavar=metavar, is_argument=True, count=count)


# -- readers ----------------------------------------------------------------------------------------------------------


def whole(first: int, last: int | None = None, most: str = "") -> Callable[[str], int]:
    """A reader of whole numbers up to ``last``, which messages show as ``most``."""

    def read(text: str) -> int:
        number = int(text) if text.isdecimal() and len(text) <= 20 else -1
        if number < first or (last is not None and number > last):
            bounds = f"of at least {first}" if last is None else f"from {first} to {most or last}"
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number {bounds}")
        return number

    return read


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


COUNT = whole(1, 10**9, "1e9")
