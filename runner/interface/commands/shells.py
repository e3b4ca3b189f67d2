"""Scripts with which shells complete the commands, made from what the commands declare to argparse."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from shlex import quote
from typing import NamedTuple

HEAD = {
    "bash": "bash: add 'source <(epicycle completion bash)' to ~/.bashrc",
    "zsh": "zsh: add 'source <(epicycle completion zsh)' to ~/.zshrc, after compinit",
    "fish": "fish: epicycle completion fish > ~/.config/fish/completions/epicycle.fish",
}

ENDS = dict.fromkeys(("FILE", "MODEL", "RESULTS", "STUDY", ".yaml", ".xml"), "files") | {"DIR": "folders"}


class Given(NamedTuple):
    """An option or argument of a command, which takes words, files or folders."""

    flags: tuple[str, ...]  # empty for an argument
    help: str
    takes: bool  # whether a value follows
    repeats: bool
    words: tuple[str, ...]
    files: str  # "files", "folders" or empty


def script(shell: str) -> str:
    """The script for a shell."""
    lines = {"bash": _bash, "zsh": _zsh, "fish": _fish}[shell]()
    return "\n".join([f"# Completion of epicycle for {HEAD[shell]}", *lines])


def _commands() -> Iterator[tuple[str, str, list[Given]]]:
    """Each command with its summary and its options and arguments."""
    from ...model.catalogue.packaged import packaged_disturbances, packaged_models, packaged_studies
    from ...model.catalogue.types import built_in
    from . import commands

    known = built_in()
    models, studies = tuple(packaged_models()), tuple(packaged_studies())
    named = {
        "MODEL": models,
        "MODEL or RESULTS": models,
        "STUDY": studies,
        "NAME or FILE": tuple(packaged_disturbances()),
        "MODEL or STUDY": (*models, *studies),
        "MODEL or TYPE": (*models, *known.actors, *known.aspects),
    }
    for each in commands():
        parser, given = argparse.ArgumentParser(add_help=False), []
        for add in each.options:
            add(parser)
        parser.add_argument("--debug", action="store_true", help="show the full traceback of an error")
        parser.add_argument("-h", "--help", action="store_true", help="show the help of the command")
        for action in parser._actions:
            metavar = action.metavar if isinstance(action.metavar, str) else ""
            words = tuple(map(str, action.choices or ())) or named.get(metavar, ())
            if (each.name, metavar) == ("validate", "MODEL"):
                words += studies
            kind = next((kind for end, kind in ENDS.items() if metavar.endswith(end)), "")
            text = " ".join((action.help or "").replace("%%", "%").split())
            repeats = isinstance(action, argparse._AppendAction)
            given.append(Given(tuple(action.option_strings), text, action.nargs != 0, repeats, words, kind))
        yield each.name, each.summary, given


def _bash() -> Iterator[str]:
    """One function: the command and the previous word decide what may follow."""
    commands = list(_commands())
    yield "_epicycle() {"
    yield '    local word="${COMP_WORDS[COMP_CWORD]}" before="${COMP_WORDS[COMP_CWORD-1]}" command="${COMP_WORDS[1]}"'
    yield '    if [ "$COMP_CWORD" -eq 1 ]; then'
    names = quote(" ".join([*(name for name, *_ in commands), "--help", "--version"]))
    yield f'        COMPREPLY=($(compgen -W {names} -- "$word"))'
    yield "        return"
    yield "    fi"
    yield '    case "$command $before" in'
    for name, _, given in commands:
        for each in given:
            if each.flags and each.takes:
                yield f"        {'|'.join(quote(f'{name} {flag}') for flag in each.flags)}) {_compgen(each)}; return ;;"
    yield "    esac"
    yield '    case "$command" in'
    for name, _, given in commands:
        flags = quote(" ".join(flag for each in given for flag in each.flags))
        yield f'        {name}) if [[ "$word" == -* ]]; then COMPREPLY=($(compgen -W {flags} -- "$word"))'
        yield f"            else {_compgen(next((each for each in given if not each.flags), None))}; fi ;;"
    yield "    esac"
    yield "}"
    yield "complete -o filenames -F _epicycle epicycle"


def _compgen(given: Given | None) -> str:
    """The code that completes a value in bash."""
    if given is None or not (given.words or given.files):
        return "COMPREPLY=()"
    kind = {"files": " -f", "folders": " -d"}.get(given.files, "")
    words = f" -W {quote(' '.join(given.words))}" if given.words else ""
    return f'COMPREPLY=($(compgen{kind}{words} -- "$word"))'


def _zsh() -> Iterator[str]:
    commands = list(_commands())
    yield "_epicycle() {"
    yield "    local -a commands=("
    for name, summary, _ in commands:
        yield f"        {quote(f'{name}:{summary}')}"
    yield "    )"
    yield "    if (( CURRENT == 2 )); then _describe command commands; return; fi"
    yield "    local command=$words[2]"
    yield "    shift words; (( CURRENT-- ))"
    yield "    case $command in"
    for name, _, given in commands:
        yield (
            f"        {name}) _arguments "
            + " ".join(quote(each) for one in given for each in _specifications(one))
            + " ;;"
        )
    yield "    esac"
    yield "}"
    yield "compdef _epicycle epicycle"


def _specifications(given: Given) -> Iterator[str]:
    """An option or argument as ``_arguments`` of zsh takes it."""
    choices = f"compadd -- {' '.join(map(quote, given.words))}; " if given.words else ""
    files = {"files": "_files; ", "folders": "_files -/; "}.get(given.files, "")
    action = f"{{{(choices + files).rstrip()}}}" if choices or files else " "
    about = "".join(f"\\{each}" if each in "[]:\\" else each for each in given.help)
    for flag in given.flags:
        yield f"{'*' if given.repeats else ''}{flag}[{about}]" + (f": :{action}" if given.takes else "")
    if not given.flags:
        yield f": :{action}"


def _fish() -> Iterator[str]:
    yield "complete -c epicycle -f"
    for name, summary, given in _commands():
        yield f"complete -c epicycle -n __fish_use_subcommand -a {name} -d {_in_fish(summary)}"
        here = f"complete -c epicycle -n '__fish_seen_subcommand_from {name}'"
        for each in given:
            words = f" -a {_in_fish(' '.join(each.words))}" if each.words else ""
            words += {"files": " -F", "folders": " -a '(__fish_complete_directories)'"}.get(each.files, "")
            flags = "".join(f" -l {flag[2:]}" if flag.startswith("--") else f" -s {flag[1:]}" for flag in each.flags)
            if each.flags:
                yield f"{here}{flags}{' -r' if each.takes else ''}{words} -d {_in_fish(each.help)}"
            elif words:
                yield f"{here}{words}"


def _in_fish(text: str) -> str:
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"
