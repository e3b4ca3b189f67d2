"""The command line: a thin face over ``commands``, and the exit codes."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from .collection import seldom_collecting
from .commands import COMMANDS
from .commands.options import BAD_INPUT, FAILED, INTERRUPTED
from .leaving import leave
from .printing import complain, complain_traceback, open_streams


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; the exit code: 0 done, 1 the run failed, 2 bad input."""
    if arguments is None:  # as a program, not called by one
        return leave(main(sys.argv[1:]))
    open_streams()
    options = parser().parse_args(arguments)
    options.given = ["epicycle", *arguments]
    from epicycle.actors import EpicycleError

    try:
        with seldom_collecting():
            code: int = options.run(options)
        sys.stdout.flush()  # here, where it can be told that it fails
        return code
    except EpicycleError as error:
        if options.debug:
            complain_traceback(error)
        from .engine import ActorError, LoopError  # here, for many commands do without the engine
        from .text import ModelError

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


def parser() -> argparse.ArgumentParser:
    """The options of all commands."""
    top = argparse.ArgumentParser(
        prog="epicycle", description="Discrete-event simulation of actor models that are written in YAML."
    )
    commands = top.add_subparsers(required=True, metavar="COMMAND")
    for each in COMMANDS:
        command = commands.add_parser(each.name, help=each.summary, description=each.description)
        for add in each.options:
            add(command)
        command.add_argument("--debug", action="store_true", help="show the whole traceback of an error")
        command.set_defaults(run=each.run)
    return top


if __name__ == "__main__":
    raise SystemExit(main())
