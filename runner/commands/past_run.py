"""A run of which a folder holds the results, to be made again."""

from __future__ import annotations

import argparse
import json
import shlex
from contextlib import redirect_stderr
from io import StringIO
from pathlib import Path

from .run import run


def as_before(options: argparse.Namespace) -> str:
    """Make options those of the run of which a folder holds the results; the digest of that run.

    What is said beside the folder counts on top.
    """
    from epicycle.actors import EpicycleError, read_regular

    path = Path(options.model) / "manifest.json"
    try:
        manifest = json.loads(read_regular(path))
        before, digest = [str(each) for each in manifest["command"]], str(manifest["digest"])
    except FileNotFoundError:
        raise EpicycleError(f"{options.model} holds no results of a run: it has no manifest.json") from None
    except (OSError, ValueError, LookupError, TypeError, RecursionError) as error:
        raise EpicycleError(f"{path} is not the manifest of a run: {error}") from None
    if before[1:2] != ["run"]:
        raise EpicycleError(f"{options.model} holds results of 'epicycle {' '.join(before[1:2])}', not of a run")
    known = argparse.ArgumentParser(exit_on_error=False)
    for add in run.options:
        add(known)
    try:
        with redirect_stderr(StringIO()):
            given, _ = known.parse_known_args(before[2:])
    except (argparse.ArgumentError, SystemExit):
        raise EpicycleError(f"{path} names a command that is unknown to this version: {shlex.join(before)}") from None
    if given.types and not options.types:  # they are code, which only the caller may allow to run
        files = " ".join(f"--types {shlex.quote(file)}" for file in given.types)
        raise EpicycleError(
            f"the run in {options.model} used types of its own\n   help: to let their code run, add {files}"
        )
    is_same = True
    for name in ("set", "overrides", "disturb", "aspect", "without"):
        is_same &= not getattr(options, name)
        setattr(options, name, [*getattr(given, name), *getattr(options, name)])
    for name in ("seed", "until", "max_actors"):
        is_same &= getattr(options, name) is None
        if getattr(options, name) is None:
            setattr(options, name, getattr(given, name))
    options.model = given.model
    return digest if is_same else ""
