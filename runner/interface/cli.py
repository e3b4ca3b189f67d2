"""The command line: a thin layer over ``commands``, and the exit codes."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Sequence
from importlib import import_module
from itertools import takewhile
from typing import Any

from ..support.collection import importing, seldom_collecting
from ..support.printing import complain, complain_traceback, open_streams
from .commands import FORMER, commands, grouped
from .commands.leaving import leave
from .commands.options import BAD_INPUT, FAILED, INTERRUPTED


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; the exit code: 0 done, 1 the run failed, 2 bad input, 3 a monitor is broken."""
    if arguments is None:  # run as a program, not called by one
        return leave(_run(sys.argv[1:], is_program=True))
    return _run(arguments, is_program=False)


def _run(arguments: Sequence[str], *, is_program: bool) -> int:
    open_streams()
    known = parser(arguments)
    if (word := next((each for each in arguments if not each.startswith("-")), "")) in FORMER:
        known.error(f"command {word!r} is gone: it is now 'epicycle {FORMER[word]}'")
    options = known.parse_args(arguments)
    options.given = ["epicycle", *arguments]
    try:
        with importing(for_good=is_program):
            from epicycle.actors import EpicycleError

            for name in options.imports:
                import_module(f"..{name}", __package__)
    except ImportError as error:
        if error.name != "EPICYCLE_CORE":
            raise
        print(f"error: {error}", file=sys.stderr)  # otherwise, complaining imports the same modules
        return BAD_INPUT

    try:
        with seldom_collecting():
            code: int = options.run(options)
        if not sys.stdout.closed:  # as a language server leaves it
            sys.stdout.flush()  # here, where a failure can be reported
        return code
    except EpicycleError as error:
        if options.debug:
            complain_traceback(error)
        from ..execution.engine import ActorError, LoopError  # here, because many commands do not need the engine
        from ..model.text.problems import ModelError

        complain(str(error) if isinstance(error, ModelError) else f"error: {error}")
        return FAILED if isinstance(error, (ActorError, LoopError)) else BAD_INPUT
    except BrokenPipeError:
        # Whoever read our output has gone; point stdout elsewhere so that Python's own flush stays quiet.
        sys.stdout = None
        return FAILED
    except OSError as error:
        complain(f"error: {error}")
        return FAILED
    except KeyboardInterrupt:
        complain("interrupted")
        return INTERRUPTED


class _Version(argparse.Action):
    """Prints the version and the core, which only the actors know."""

    def __init__(self, option_strings: Sequence[str], dest: str, **given: Any) -> None:
        super().__init__(option_strings, dest, nargs=0, **given)

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        try:
            from epicycle.actors import CORE, CORE_REASON
        except ImportError as error:
            parser.error(str(error))
        from ..study.provenance import versions

        found, why = versions(), f" ({CORE_REASON})" if CORE_REASON else ""
        print(f"epicycle {found['epicycle']}, {CORE} core{why}, Python {found['python']}")
        parser.exit()


class _Parser(argparse.ArgumentParser):
    """Refuses unknown options itself: otherwise the top one does, which does not tell those of a command."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        if self._subparsers is None:  # what follows a command is for its own parser
            self._refuse_misspelt(takewhile(lambda each: each != "--", args or ()))
        options, unknown = super().parse_known_args(args, namespace)
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}")
        return options, unknown

    def _refuse_misspelt(self, arguments: Iterable[str]) -> None:
        """Tell what was meant by an option that is nearly one, before others are said to be missing."""
        known = [option for option in self._option_string_actions if option.startswith("--")]
        for name in (each.partition("=")[0] for each in arguments if each.startswith("--")):
            if not any(option.startswith(name) for option in known):  # which may be shortened
                from epicycle.actors import did_you_mean

                if near := did_you_mean(name, known):
                    self.error(f"unrecognized arguments: {name}{near}")


def parser(arguments: Sequence[str] = ()) -> argparse.ArgumentParser:
    """The parser for all commands; only those that arguments may name get their options, which take long to make."""
    known = commands(arguments)
    top = _Parser(
        prog="epicycle",
        description="Discrete-event simulation of actor models written in YAML.",
        epilog=grouped(known),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    top.add_argument("--version", action=_Version, help="show the version and the core that makes the runs")
    parsers = top.add_subparsers(required=True, metavar="COMMAND", help=argparse.SUPPRESS)
    for each in known:
        command = parsers.add_parser(each.name, description=each.description)
        for add in each.options if each.name in arguments else ():
            add(command)
        command.add_argument("--debug", action="store_true", help="show the full traceback of an error")
        command.set_defaults(run=each.run, imports=each.imports)
    return top


if __name__ == "__main__":
    raise SystemExit(main())
