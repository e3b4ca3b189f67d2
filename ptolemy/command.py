"""The command that converts a file of Ptolemy II to a model."""

from __future__ import annotations

import argparse
from pathlib import Path

from epicycle.runner.interface.commands import DONE, TYPES, Command, complain, option, own_types, tell


def _run(options: argparse.Namespace) -> int:
    from epicycle.actors import EpicycleError
    from epicycle.runner import load_model

    from .importing import import_moml

    types = own_types(options)
    if options.out is not None and options.out.suffix not in (".yaml", ".yml"):
        raise EpicycleError(f"{options.out} is not a name for a model file: it must end in .yaml")
    found = import_moml(options.file, lambda path: load_model(path, types=types), types)
    for note in found.notes:
        complain(f"note: {note}")
    if options.out is None:
        tell(found.text.rstrip("\n"))
    else:
        options.out.write_text(found.text, encoding="utf-8")
        tell(f"wrote {options.out}")
    return DONE


import_ = Command(  # "import" is a keyword in Python
    "import",
    "convert a MoML file of Ptolemy II to a model",
    "Import a model of Ptolemy II: a MoML file with a DE director becomes a model in YAML, in which "
    "'director: {like: ptolemy}' keeps the semantics of Ptolemy II. Layout, icons and views are left out. Anything "
    "else without a counterpart is reported in a line, here and at the head of the model. Test actors become checks, "
    "which 'epicycle run' evaluates. A model that cannot be expressed is refused with the reasons (exit code 2), and "
    "nothing is written. No other file is read.",
    (
        option("file", metavar="MODEL.xml", type=Path, help="the MoML file"),
        option("-o", "--out", metavar="MODEL.yaml", type=Path, help="write to this file (default: print the model)"),
        TYPES,
    ),
    ("model.build",),
    _run,
)
