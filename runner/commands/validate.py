"""check a model or a study"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..printing import complain, tell
from .options import DONE, add_model, load

DESCRIPTION = "Check a model, or a study with all that it varies, without running it."


def add(command: argparse.ArgumentParser) -> None:
    """The options of ``epicycle validate``."""
    add_model(command)
    command.add_argument("--strict", action="store_true", help="take warnings for errors")


def run(options: argparse.Namespace, given: list[str]) -> int:
    """Load the model, and say how large it is."""
    if is_study(options.model):
        return check_study(options)
    model = load(options, strict=options.strict)
    if model.endless:
        from epicycle.actors import EpicycleError

        told = f"{model.endless}\n   help: write 'run: {{stop: 60 s}}', or run it with --until"
        if options.strict:
            raise EpicycleError(told)
        complain(f"warning: {told}")
    tell(f"{options.model} is valid: {model.extent}")
    return DONE


def is_study(name: str) -> bool:
    """Whether a packaged study has that name, or the file says that it is one."""
    from ..catalogue import is_path, packaged_models, packaged_studies
    from ..language import is_study

    if is_path(name):
        return is_study(Path(name))
    return name in packaged_studies() and name not in packaged_models()


def check_study(options: argparse.Namespace) -> int:
    """Load the model at every level of what the study varies."""
    from epicycle.actors import EpicycleError, counted

    from ..language import read_study
    from ..show.report import check_figures
    from ..study import Plan

    for option in ("overrides", "disturb", "aspect", "without"):
        if getattr(options, option):
            raise EpicycleError(f"--{option} is for models: a study says itself what it changes")
    types = [Path(file) for file in options.types]
    plan = Plan.made(read_study(options.model, set=options.set, types=types))
    check_figures(plan)
    tell(
        f"{options.model} is valid: {counted(plan.conditions, 'condition')} of "
        f"{counted(plan.replications, 'replication')}, {counted(plan.size, 'run')}"
    )
    return DONE
