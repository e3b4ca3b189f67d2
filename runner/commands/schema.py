"""write a JSON Schema of model files, for editors"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..printing import complain, tell, tell_json_text
from .options import DONE, add_types, own_types

DESCRIPTION = (
    "Write a JSON Schema of model files, made from the installed actors and aspects. An editor with a YAML language "
    "server completes and checks a model whose first line is '# yaml-language-server: $schema=FILE'."
)


def add(command: argparse.ArgumentParser) -> None:
    """The options of ``epicycle schema``."""
    command.add_argument("-o", "--out", metavar="FILE", type=Path, help="write to FILE (default: standard output)")
    add_types(command)


def run(options: argparse.Namespace, given: list[str]) -> int:
    """Write the schema."""
    from ..catalogue import figure_types, installed
    from ..language import json_schema, schema_text
    from ..show.report import study_figure_types

    catalogue, errors = installed().with_types(own_types(options)).loaded()
    for error in errors:
        complain(f"warning: {error}")
    text = schema_text(json_schema(catalogue, figure_types(), study_figure_types()))
    if options.out is None:
        tell_json_text(text)
    else:
        options.out.write_text(text, encoding="utf-8")
        tell(f"wrote {options.out}")
    return DONE
