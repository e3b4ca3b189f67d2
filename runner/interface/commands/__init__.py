"""The commands of the command line, by what people want, and what they are made of.

Installed packages add to them by entry points of the group ``epicycle.commands``.
"""

from __future__ import annotations

from collections.abc import Sequence

from ...support.printing import complain, tell
from . import completion, describe, listing, new, recording, running, searching, serving, studies
from .offered import offered_commands
from .options import BAD_INPUT, BROKEN, DONE, FAILED, JSON, TYPES, Command, command, option, own_types, several

GROUPS = {
    "look at one run": (running.run, running.view, searching.explain, searching.what_if),
    "make many runs": (studies.study, studies.status, studies.report, searching.compare),
    "search": (searching.search, searching.rare),
    "work with recorded data": (recording.recording,),
    "write models": (
        new.new,
        describe.validate,
        describe.diff,
        describe.describe,
        describe.graph,
        listing.list_,
        serving.lsp,
        serving.mcp,
        serving.studio,
    ),
    "set up a shell": (completion.completion,),
}
COMMANDS = tuple(each for group in GROUPS.values() for each in group)

# What commands were called before, and what they are now.
FORMER = {
    "trace": "run MODEL --trace",
    "falsify": "search MODEL --break",
    "optimise": "search MODEL --minimise METRIC",
    "calibrate": "search MODEL --match SIGNAL=FILE",
    "fit": "recording fit TRACE",
    "disturb": "recording apply RECORDING --with DISTURBANCE",
    "resume": "study DIR",
    "replay": "run DIR/RUN",
    "show": "describe MODEL",
    "models": "list models",
    "actors": "list actors', and one of them 'epicycle describe TYPE",
    "aspects": "list aspects', one of them 'epicycle describe TYPE', a model's 'epicycle describe MODEL --aspects",
    "schema": "list schema",
}


def commands(arguments: Sequence[str] = ()) -> tuple[Command, ...]:
    """Our own commands and, unless the arguments name one of these, those of installed packages; our names win."""
    own = {each.name for each in COMMANDS}
    if next((each for each in arguments if not each.startswith("-")), "") in own:
        return COMMANDS  # the others are searched for and imported only where that makes a difference
    return (*COMMANDS, *(each for each in offered_commands() if each.name not in own))


def grouped(known: Sequence[Command]) -> str:
    """The commands with their summaries, by what people want."""
    others = tuple(each for each in known if each not in COMMANDS)
    width = max(len(each.name) for each in known) + 2
    text = []
    for what, group in {**GROUPS, "of installed packages": others}.items():
        if group:
            text += ["", f"{what}:", *(f"  {each.name:{width}}{each.summary}" for each in group)]
    return "\n".join(text[1:])


__all__ = [
    "BAD_INPUT",
    "BROKEN",
    "COMMANDS",
    "DONE",
    "FAILED",
    "FORMER",
    "GROUPS",
    "JSON",
    "TYPES",
    "Command",
    "command",
    "commands",
    "complain",
    "grouped",
    "option",
    "own_types",
    "several",
    "tell",
]
