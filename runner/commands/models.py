"""list the packaged models, disturbances and studies"""

from __future__ import annotations

import argparse

from ..printing import tell
from .options import DONE

DESCRIPTION = "List the models that come with Epicycle, the disturbances for --disturb, and the studies."


def add(command: argparse.ArgumentParser) -> None:
    """``epicycle models`` has no options."""


def run(options: argparse.Namespace, given: list[str]) -> int:
    """Print every packaged model, disturbance and study with the first sentence of its doc."""
    from ..build import load_model
    from ..catalogue import packaged_disturbances, packaged_models, packaged_studies
    from ..language import load_disturbance, read_study
    from ..text import Problems

    for name, path in packaged_models().items():
        print_line(name, load_model(path).doc)
    tell("\ndisturbances, to be added with --disturb:")
    problems = Problems()
    for name in packaged_disturbances():
        disturbance = load_disturbance(name, problems)
        problems.raise_if_any()
        print_line(name, disturbance.text.doc if disturbance is not None else "")
    tell("\nstudies, to be run with epicycle study:")
    for name in packaged_studies():
        print_line(name, read_study(name).doc)
    return DONE


def print_line(name: str, doc: str) -> None:
    """A name with the first sentence of what is said of it."""
    first, _, _ = doc.partition(". ")
    tell(f"{name}: {first}" if doc else name)
