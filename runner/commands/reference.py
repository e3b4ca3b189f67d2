"""What ``epicycle actors`` and ``epicycle aspects`` share."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Mapping
from typing import Any

from ..printing import complain, console, tell_json


def add_json(command: argparse.ArgumentParser) -> None:
    """The option ``--json``."""
    command.add_argument("--json", action="store_true", help="print JSON")


def print_reference(
    types: Mapping[str, type[Any]],
    others: Mapping[str, type[Any]],
    kind: str,
    name: str | None,
    as_json: bool,
    *,
    also: Iterable[str] = (),
) -> None:
    """The list of all types, or all about one; ``others`` are those of the other kind, ``also`` names that could have
    been meant, too."""
    from dataclasses import asdict

    from epicycle.actors import EpicycleError

    from ..catalogue import load_all
    from ..show import described, detail, overview, parts_described
    from ..text import did_you_mean

    if name is not None:
        if name not in types:
            if name in others:
                other = "aspect" if kind == "actor" else "actor"
                raise EpicycleError(
                    f"{name} is an {other}, not an {kind}\n   help: 'epicycle {other}s {name}' describes it"
                )
            what = f"{kind} type or packaged model" if also else f"{kind} type"
            raise EpicycleError(
                f"there is no {what} {name!r}{did_you_mean(name, [*types, *also])}\n"
                f"   help: 'epicycle {kind}s' lists them\n"
                f"   help: one of your own is known after '--types FILE.py'"
            )
        (reference,) = described({name: types[name]})
        parts = parts_described([types[name]])
        if as_json:
            tell_json(
                {**asdict(reference), "parts": {k: [asdict(each) for each in v] for k, v in parts.items()}}, indent=2
            )
        else:
            console().print(detail(reference, parts))
        return
    loaded, errors = load_all(types)
    for error in errors:
        complain(f"warning: {error}")
    references = described(loaded)
    if as_json:
        tell_json([asdict(each) for each in references], indent=2)
    else:
        console().print(overview(references))
