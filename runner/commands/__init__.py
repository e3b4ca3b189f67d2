"""The commands of the command line, in the order in which ``epicycle --help`` names them, and what they are made of.

Installed packages add to them by entry points of the group ``epicycle.commands``.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..printing import complain, tell
from . import (
    calibrate,
    compare,
    completion,
    describe,
    disturb,
    explain,
    falsify,
    fit,
    new,
    optimise,
    rare,
    run,
    show,
    studies,
    trace,
    view,
)
from .offered import offered_commands
from .options import BAD_INPUT, BROKEN, DONE, FAILED, JSON, TYPES, Command, command, option, own_types, several

COMMANDS = (
    run.run,
    view.view,
    compare.compare,
    explain.explain,
    falsify.falsify,
    optimise.optimise,
    calibrate.calibrate,
    rare.rare,
    fit.fit,
    disturb.disturb,
    studies.study,
    studies.resume,
    studies.status,
    studies.replay,
    studies.report,
    trace.trace,
    describe.validate,
    show.show,
    describe.graph,
    describe.models,
    describe.actors,
    describe.aspects,
    describe.schema,
    new.new,
    completion.completion,
)


def commands(arguments: Sequence[str] = ()) -> tuple[Command, ...]:
    """Our own commands and, unless the arguments name one of these, those of installed packages; our names win."""
    own = {each.name for each in COMMANDS}
    if next((each for each in arguments if not each.startswith("-")), "") in own:
        return COMMANDS  # the others are searched for and imported only where that makes a difference
    return (*COMMANDS, *(each for each in offered_commands() if each.name not in own))


__all__ = [
    "BAD_INPUT",
    "BROKEN",
    "COMMANDS",
    "DONE",
    "FAILED",
    "JSON",
    "TYPES",
    "Command",
    "command",
    "commands",
    "complain",
    "option",
    "own_types",
    "several",
    "tell",
]
