"""The command that serves agents."""

from __future__ import annotations

import argparse
from pathlib import Path

from ...support.extras import needed
from .options import DONE, TYPES, command, option


@command(
    "serve an assistant: tools to check, run, compare and explain models, over standard input and output",
    option("folder", metavar="FOLDER", type=Path, help="the only folder whose files are read"),
    option("--seconds", metavar="S", type=float, default=60.0, help="limit for each call (default: 60)"),
    TYPES,
    imports=(),
)
def mcp(options: argparse.Namespace) -> int:
    """Serve an assistant by the Model Context Protocol, over standard input and output.

    docs/agents.md says how to set it up.  Each call is a process of its own, with limits of time, memory and output;
    only files in FOLDER are read, and no code but that of --types is run.  It needs the extra 'agents': pip install
    'epicycle[agents]'.
    """
    from epicycle.actors import EpicycleError

    from ...study.provenance import version_of

    if not options.folder.is_dir():
        raise EpicycleError(f"there is no folder {options.folder}")
    if not 0 < options.seconds <= 3600:
        raise EpicycleError(f"--seconds {options.seconds:g}: expected a number of seconds from 0 to 3600")
    server = needed("epicycle.runner.interface.agents.server", "'epicycle mcp'", "agents")
    from ..agents import LimitedCall, Limits

    call = LimitedCall(options.folder, getattr(options, "types", ()), Limits(seconds=options.seconds))
    server.make_server(call, version_of("epicycle") or "", _parsers()).run()
    return DONE


def _parsers() -> dict[str, argparse.ArgumentParser]:
    """The parsers of the commands, which know what each option is."""
    from . import COMMANDS

    found = {}
    for each in COMMANDS:
        words = each.description or each.summary
        parser = found[each.name] = argparse.ArgumentParser(description=words, add_help=False)
        for given in each.options:
            given(parser)
    return found
