"""complete commands, options and names in a shell"""

from __future__ import annotations

import argparse

from ..printing import tell
from .options import DONE, command, option


@command(
    "print a completion script for a shell",
    option("shell", choices=("bash", "zsh", "fish"), help="the shell"),
    imports=("catalogue",),
)
def completion(options: argparse.Namespace) -> int:
    """Print a script by which a shell completes commands, options, and the names of what is packaged now."""
    from .shells import script  # here, as it is for this command alone

    tell(script(options.shell))
    return DONE
