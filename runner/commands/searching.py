"""What the commands share that make runs until they have an answer: their options, and how they end."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol, TypeVar

from ..printing import complain, tell, tell_json
from .options import FAILED, INTERRUPTED, JOBS, RUN_TIMEOUT, TYPES, Option, first_seed, option, several

VARY = several(
    "--vary",
    metavar="PATH=VALUES",
    help="search a parameter: load=0.5..0.9, period='1 s..5 s', 'policy=[fifo, lifo]'; may be repeated",
)
SET = several("--set", metavar="PATH=VALUE", help="set a parameter in all runs; may be repeated")
JSON = option("--json", action="store_true", help="print one JSON object instead of the text")
ENDING = (JSON, TYPES)
WORKERS = (JOBS, RUN_TIMEOUT)


class Answer(Protocol):
    """What a search found: a text for people, and facts for programs."""

    def facts(self) -> dict[str, Any]:
        """The answer as JSON."""
        ...


Found = TypeVar("Found", bound=Answer)


def monitor(example: str, *, default: str = "") -> Option:
    """The monitor that a search is about; without a ``default``, it must be given."""
    text = f"a monitor of the model, or a property such as '{example}'" + (f" (default: {default})" if default else "")
    return option("--monitor", metavar="NAME or PROPERTY", required=not default, help=text)


def seed_of_search(text: str, default: int | None = None) -> Option:
    """The seed of a search and of its first run."""
    return option("--seed", type=first_seed, metavar="N", default=default, help=text)


def out(default: str) -> Option:
    """The folder of a search."""
    return option("--out", metavar="DIR", type=Path, help=f"folder for what is found (default: results/{default})")


def folder_of(options: argparse.Namespace, name: str, kind: str) -> Path:
    """The folder that ``--out`` gives, or the one of this kind of search for a model of this name."""
    from epicycle.actors import abridged

    given: Path | None = options.out
    return given or Path("results") / abridged(name, 60) / kind


def answer(
    options: argparse.Namespace,
    search: Callable[[], Found],
    written: Callable[[Found], Sequence[Path]],
    code: Callable[[Found], int],
) -> int:
    """Make a search, tell what it found and the files that have it, and give its exit code."""
    from ..study import WorkerError, WriteError

    try:
        found = search()
    except KeyboardInterrupt:
        complain("interrupted; finished runs are kept: the same command continues")
        return INTERRUPTED
    except (WorkerError, WriteError) as error:
        complain(f"error: {error}")
        return FAILED
    paths = written(found)
    if options.json:
        tell_json(found.facts())
        return code(found)
    tell(str(found))
    for path in paths:
        tell(f"wrote {path}")
    return code(found)
