"""The page of the documents that lists all kinds of problems, made from their declarations."""

from __future__ import annotations

import shlex
from pathlib import Path

from epicycle.runner.desk import Reading, read
from epicycle.runner.model.text.kinds import KINDS, Kind

COMMAND = "# epicycle validate example.yaml"
_HEAD = """# Kinds of problems

Each problem of a model has a code that stays the same, whatever its message says. Programs use it: `epicycle validate
--json MODEL`, editors, and your own scripts. Codes with E are errors, codes with W are warnings.
`make reference` writes this page from `runner/model/text/kinds.py`.
"""


def page() -> str:
    """A heading, a paragraph and an example for each kind."""
    return "\n".join([_HEAD, *map(_section, KINDS.values())])


def example(kind: Kind) -> Reading:
    """The example of a kind, read as ``example.yaml``."""
    first, _, rest = kind.example.partition("\n")
    words = shlex.split(first.removeprefix(COMMAND)) if first.startswith(COMMAND) else []
    settings = [each for each in words if each != "--set"]
    path = Path("example.yaml")
    return read(path, {path.resolve(): (rest if words else kind.example) + "\n"}, set=settings)


def _section(kind: Kind) -> str:
    lines = [f"## {kind.code}: {kind.title}", "", kind.doc, ""]
    if kind.example:
        found = next(each for each in example(kind).problems if each.kind == kind)
        lines += ["```text", kind.example, "```", "", "```", str(found), "```", ""]
    return "\n".join(lines)
