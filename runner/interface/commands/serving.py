"""The commands that serve editors, the browser, and assistants."""

from __future__ import annotations

import argparse
import webbrowser
from pathlib import Path

from ...support.declare.parameters import COUNT, positive_seconds
from ...support.extras import needed
from ...support.printing import tell
from .options import DONE, TYPES, command, option, own_types


@command(
    "serve an editor: problems, completion, descriptions, new names, over standard input and output",
    TYPES,
    imports=("model.build",),
)
def lsp(options: argparse.Namespace) -> int:
    """Serve an editor by the Language Server Protocol, over standard input and output.

    docs/editors.md says how to set up VS Code, Neovim, Emacs, Helix and JetBrains' editors. It needs the extra
    'editor': pip install 'epicycle[editor]'.
    """
    from ...study.provenance import version_of

    server = needed("epicycle.runner.desk.server", "'epicycle lsp'", "editor")
    server.make_server(version_of("epicycle") or "", tuple(own_types(options))).start_io()
    return DONE


@command(
    "write a model in the browser: text, graph, and the run of what is written so far",
    option("model", metavar="MODEL.yaml", type=Path, help="the model's file; a new one is written when you save"),
    TYPES,
    option("--port", type=int, default=0, metavar="N", help="port on this machine (default: any that is free)"),
    option("--seconds", type=positive_seconds, default=60.0, metavar="S", help="longest time of a run (default: 60)"),
    option("--events", type=COUNT, default=2_000_000, metavar="N", help="most events of a run (default: 2,000,000)"),
    option("--no-browser", action="store_true", help="print the address only"),
    imports=("model.build",),
)
def studio(options: argparse.Namespace) -> int:
    """Write a model in the browser: its text with problems and completion, its graph, and its run.

    The text is the only source: fields, switches and wires write it, and the file is written when you save. The page is
    served to this machine only, at an address that nobody can guess. It needs the extra 'studio':
    pip install 'epicycle[studio]'.
    """
    from epicycle.actors import EpicycleError

    path: Path = options.model
    if path.suffix != ".yaml":
        raise EpicycleError(f"{path} is no file of a model: its name ends with .yaml")
    if not path.resolve().parent.is_dir():
        raise EpicycleError(f"there is no folder {path.parent}")
    own_types(options)  # what is wrong with them is said here
    server = needed("epicycle.runner.interface.studio.server", "'epicycle studio'", "studio")

    def opened(address: str) -> None:
        tell(f"{path} is open at {address}\nCtrl-C ends it")
        if not options.no_browser:
            webbrowser.open(address)

    document, types = server.Document(path), getattr(options, "types", ())
    server.serve(server.Studio(document, options.seconds, options.events, types), options.port, opened)
    return DONE


@command(
    "serve an assistant: tools to check, run, compare and explain models, over standard input and output",
    option("folder", metavar="FOLDER", type=Path, help="the only folder whose files are read"),
    option("--seconds", metavar="S", type=positive_seconds, default=60.0, help="limit for each call (default: 60)"),
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
    server = needed("epicycle.runner.interface.agents.server", "'epicycle mcp'", "agents")
    from ..agents import LimitedCall

    call = LimitedCall(options.folder, getattr(options, "types", ()), options.seconds)
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
