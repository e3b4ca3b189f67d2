"""resume a study"""

from __future__ import annotations

import argparse
from pathlib import Path

from . import study

DESCRIPTION = "Make the runs that are missing in the results folder of a study."


def add(command: argparse.ArgumentParser) -> None:
    """The options of ``epicycle resume``."""
    command.add_argument("folder", metavar="DIR", type=Path, help="the results folder")
    study.add_session(command)


def run(options: argparse.Namespace, given: list[str]) -> int:
    """Go on where the study was left, however it ended."""
    from ..study import plan_of_folder

    study.check_session(options)
    return study.session(plan_of_folder(options.folder), options.folder, options)
