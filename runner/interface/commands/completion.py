"""complete commands, options and names in a shell"""

from __future__ import annotations

import argparse

from ...support.printing import tell
from .options import DONE, command, option


@command(
    "print a completion script for a shell",
    option("shell", choices=("bash", "zsh", "fish"), help="the shell"),
    imports=("model.catalogue",),
)
def completion(options: argparse.Namespace) -> int:
    """Print a script with which a shell completes commands, options and the names of everything packaged now."""
    from .shells import script  # here, because only this command needs it

    tell(script(options.shell))
    return DONE
