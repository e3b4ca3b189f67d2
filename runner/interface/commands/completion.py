"""complete commands, options and names in a shell"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from shlex import quote
from typing import Any

from ...support.printing import tell
from .options import DONE, command, option

FILES = ("FILE", "MODEL", "RESULTS", "STUDY", "RECORDING", ".yaml", ".xml")  # how metavars of files end


@command(
    "print a completion script for a shell",
    option("shell", choices=("bash", "zsh", "fish", "tcsh", "powershell"), help="the shell"),
    imports=("model.catalogue",),
)
def completion(options: argparse.Namespace) -> int:
    """Print a script with which a shell completes commands, options and the names of everything packaged now.

    bash, zsh: eval "$(epicycle completion bash)" in ~/.bashrc, or ~/.zshrc after compinit; fish: write it to
    ~/.config/fish/completions/epicycle.fish.
    """
    import shtab

    from . import commands  # here, because this is one of them

    parser = argparse.ArgumentParser("epicycle", description="Discrete-event simulation of actor models")
    parser.add_argument("--version", action="store_true", help="show the version")
    parsers = parser.add_subparsers()
    for each in commands():
        made = parsers.add_parser(each.name, help=each.summary, description=each.summary)
        for add in each.options:
            add(made)
        made.add_argument("--debug", action="store_true", help="show the full traceback of an error")
    _complete(parser, _packaged())
    script = shtab.complete(parser, options.shell)
    tell(f"eval {quote(script)}" if options.shell == "zsh" else script)  # so that it may be sourced, too
    return DONE


def _packaged() -> dict[str, Sequence[str]]:
    """The names that can stand in place of a file, by metavar."""
    from ...model.catalogue.packaged import packaged_disturbances, packaged_models, packaged_studies
    from ...model.catalogue.types import built_in

    known, models, studies = built_in(), tuple(packaged_models()), tuple(packaged_studies())
    return {
        "MODEL": (*models, *studies),
        "MODEL or RESULTS": models,
        "STUDY": studies,
        "NAME or FILE": tuple(packaged_disturbances()),
        "MODEL or STUDY": (*models, *studies),
        "MODEL or TYPE": (*models, *known.actors, *known.aspects),
    }


def _complete(parser: argparse.ArgumentParser, packaged: dict[str, Sequence[str]]) -> None:
    """Tell shtab what the arguments and options of a parser take: files, folders, or names as well."""
    import shtab

    for action in parser._actions:
        metavar = action.metavar if isinstance(action.metavar, str) else ""
        marked: Any = action
        if isinstance(action, argparse._SubParsersAction):
            for each in action.choices.values():
                _complete(each, packaged)
        elif metavar in packaged:
            marked.complete = _names(metavar, packaged[metavar])
        elif metavar == "DIR":
            marked.complete = shtab.DIR
        elif metavar.endswith(FILES):
            marked.complete = shtab.FILE


def _names(metavar: str, names: Sequence[str]) -> dict[str, Any]:
    """Names and files, as shtab has code for each shell."""
    import shtab

    listed, function = " ".join(names), f"_epicycle_file_{metavar.replace(' ', '_')}"
    offered = f"{function}() {{\n  compgen -W {quote(listed)} -- $1\n  compgen -f -- $1\n}}"
    return {
        **shtab.FILE,
        "bash": function,
        "zsh": f"{{compadd -- {listed}; _files}}",
        "fish": f"{listed} {shtab.FILE['fish']}",
        "preamble": {"bash": offered},
    }
