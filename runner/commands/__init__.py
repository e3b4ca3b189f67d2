"""The commands of the command line, one a module.

The docstring of a module is what ``epicycle --help`` says of it; ``add`` declares its options, ``run`` does it and
returns the exit code.  Nothing heavy is imported before ``run``, so that ``--help`` answers at once.
"""

from __future__ import annotations

from . import actors, aspects, graph, models, replay, report, resume, run, schema, status, study, trace, validate

COMMANDS = (run, study, resume, status, replay, report, trace, validate, graph, models, actors, aspects, schema)

__all__ = ["COMMANDS"]
