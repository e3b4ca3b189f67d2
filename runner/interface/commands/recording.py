"""Recorded data: channels fitted to a trace, and recordings that pass a disturbance."""

from __future__ import annotations

import argparse
from pathlib import Path

from ...support.declare.commands import arguments
from ...support.printing import tell, tell_json
from ..calls import recording as calls
from .options import DONE, JSON, check_path, command, of_call, option


def _fit(options: argparse.Namespace) -> int:
    check_path("--out", options.out)
    found = calls.fit(**arguments(calls.fit, options))
    if options.out is not None:
        found.save(options.out)
    if options.json:
        tell_json(found.facts())
        return DONE
    tell(str(found))
    tell(f"\n{found.disturbance()}".rstrip() if options.out is None else f"wrote {options.out}")
    return DONE


def _apply(options: argparse.Namespace) -> int:
    if not Path(options.recording).is_dir():  # what replaces a folder checks that by itself
        check_path("--out", options.out)
    found = calls.disturb(**arguments(calls.disturb, options))
    if options.json:
        tell_json(found.facts())
        return DONE
    tell(str(found))
    tell(f"wrote {options.out}")
    return DONE


OUT = option("-o", "--out", metavar="FILE", type=Path, help="write the disturbance there (default: print it)")
ACTIONS = {
    "fit": of_call(calls.fit, OUT, JSON, imports=())(_fit),
    "apply": of_call(calls.disturb, JSON, imports=())(_apply),
}


def _actions(parser: argparse.ArgumentParser) -> None:
    actions = parser.add_subparsers(required=True, metavar="ACTION")
    for name, made in ACTIONS.items():
        action = actions.add_parser(name, help=made.summary, description=made.description)
        for add in made.options:
            add(action)
        action.add_argument("--debug", action="store_true", help="show the full traceback of an error")
        action.set_defaults(make=made.run)


@command("fit channels to measured traces, and apply disturbances to recordings", _actions, imports=("recorded",))
def recording(options: argparse.Namespace) -> int:
    """Work on data that were recorded outside of runs."""
    code: int = options.make(options)
    return code
