"""The command that serves editors."""

from __future__ import annotations

import argparse

from .options import DONE, TYPES, command, own_types


@command(
    "serve an editor: problems, completion, descriptions, new names, over standard input and output",
    TYPES,
    imports=("build",),
)
def lsp(options: argparse.Namespace) -> int:
    """Serve an editor by the Language Server Protocol, over standard input and output.

    docs/editors.md says how to set up VS Code, Neovim, Emacs, Helix and JetBrains' editors. It needs the extra
    'editor': pip install 'epicycle[editor]'.
    """
    from epicycle.actors import EpicycleError

    from ..study.provenance import version_of

    try:
        from ..desk.server import make_server
    except ImportError as error:
        if not str(error.name).startswith(("pygls", "lsprotocol")):
            raise
        message = "'epicycle lsp' needs the package pygls, which is not installed: pip install 'epicycle[editor]'"
        raise EpicycleError(message) from None
    make_server(version_of("epicycle") or "", tuple(own_types(options))).start_io()
    return DONE
