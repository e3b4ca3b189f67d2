"""check a model"""

from __future__ import annotations

import argparse

from .options import DONE, add_model, load

DESCRIPTION = "Check a model without running it."


def add(command: argparse.ArgumentParser) -> None:
    """The options of ``epicycle validate``."""
    add_model(command)
    command.add_argument("--strict", action="store_true", help="take warnings for errors")


def run(options: argparse.Namespace, given: list[str]) -> int:
    """Load the model, and say how large it is."""
    model, _ = load(options, strict=options.strict)
    print(f"{options.model} is valid: {model.extent}")
    return DONE
