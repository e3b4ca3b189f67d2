"""Options made from what a call says of its parameters, and the arguments of the call made from options."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypedDict, Unpack

import pytest

from epicycle.runner.support.declare.commands import add_options, arguments, declared
from epicycle.runner.support.declare.parameters import argument, option, positive_seconds, repeated, whole

if TYPE_CHECKING:
    from nowhere import Thing  # type: ignore[import-not-found]


class More(TypedDict, total=False):
    """What several calls take."""

    names: Annotated[Iterable[str], repeated("a name", "NAME", flag="--name")]
    limit: Annotated[int, option("a limit", "N", whole(1, 9))]


def call(
    thing: Annotated[Thing | str, argument("what it is about", "THING")],
    out: Annotated[Path | None, option("where to", "FILE", Path, flag="-o --out")] = None,
    *,
    kind: Annotated[Literal["a", "b"], option("of which kind", choices=("a", "b"))] = "a",
    times: Annotated[int, option("how often", "N", whole(0))] = 3,
    pace: Annotated[float | None, option("how fast", "FACTOR", positive_seconds, bare=1.0)] = None,
    all_of_it: Annotated[bool, option("all of it")] = False,
    hidden: int = 7,
    **more: Unpack[More],
) -> None:
    """Do something."""


@pytest.fixture
def parser() -> argparse.ArgumentParser:
    made = argparse.ArgumentParser(prog="call", exit_on_error=False)
    add_options(made, call)
    return made


def test_each_parameter_with_an_option_is_declared() -> None:
    assert [(each.name, each.flag, each.is_switch) for each in declared(call)] == [
        ("thing", "--thing", False),
        ("out", "-o --out", False),
        ("kind", "--kind", False),
        ("times", "--times", False),
        ("pace", "--pace", False),
        ("all_of_it", "--all-of-it", True),
        ("names", "--name", False),
        ("limit", "--limit", False),
    ]


def test_what_is_not_given_has_its_default(parser: argparse.ArgumentParser) -> None:
    assert arguments(call, parser.parse_args(["x"])) == {"thing": "x", "all_of_it": False}


def test_what_is_given(parser: argparse.ArgumentParser) -> None:
    words = "x -o f --kind b --times 0 --pace 2.5 --all-of-it --name one --name two --limit 9"
    assert arguments(call, parser.parse_args(words.split())) == {
        "thing": "x",
        "out": Path("f"),
        "kind": "b",
        "times": 0,
        "pace": 2.5,
        "all_of_it": True,
        "names": ["one", "two"],
        "limit": 9,
    }
    assert arguments(call, parser.parse_args(["x", "--pace"]))["pace"] == 1.0


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["x", "--limit", "10"], "argument --limit: '10' is not a whole number from 1 to 9"),
        (["x", "--times", "-1"], "argument --times: '-1' is not a whole number of at least 0"),
        (["x", "--pace", "0"], "argument --pace: '0' is not a number of seconds greater than 0"),
    ],
)
def test_what_is_wrong(words: list[str], told: str, parser: argparse.ArgumentParser) -> None:
    with pytest.raises(argparse.ArgumentError) as caught:
        parser.parse_args(words)
    assert str(caught.value) == told


def test_help_shows_each_default_that_says_something(parser: argparse.ArgumentParser) -> None:
    told = " ".join(parser.format_help().split())
    assert told.endswith(
        "positional arguments: THING what it is about options: -h, --help show this help message and exit "
        "-o FILE, --out FILE where to --kind {a,b} of which kind (default: a) --times N how often (default: 3) "
        "--pace [FACTOR] how fast --all-of-it all of it --name NAME a name; may be repeated --limit N a limit"
    )


def test_some_of_them() -> None:
    made = argparse.ArgumentParser()
    add_options(made, call, only={"kind", "times"}, dest={"kind": "sort"})
    assert vars(made.parse_args(["--kind", "b", "--times", "4"])) == {"sort": "b", "times": 4}
    made = argparse.ArgumentParser()
    add_options(made, call, without={each.name for each in declared(call)} - {"limit"})
    assert vars(made.parse_args(["--limit", "4"])) == {"limit": 4}


def test_what_has_no_default_is_required() -> None:
    def writes(*, out: Annotated[str, option("where to", "FILE")]) -> None:
        """Write."""

    made = argparse.ArgumentParser(prog="writes", exit_on_error=False)
    add_options(made, writes)
    with pytest.raises(SystemExit):
        made.parse_args([])
