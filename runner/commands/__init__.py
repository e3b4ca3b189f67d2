"""The commands of the command line, one a module.

The docstring of a module is what ``epicycle --help`` says of it; ``add`` declares its options, ``run`` does it and
returns the exit code.  Nothing heavy is imported before ``run``, so that ``--help`` answers at once.
"""

from __future__ import annotations

from . import actors, aspects, graph, models, run, schema, trace, validate

COMMANDS = (run, trace, validate, graph, models, actors, aspects, schema)

__all__ = ["COMMANDS"]
