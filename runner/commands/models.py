"""list the packaged models"""

from __future__ import annotations

import argparse

from .options import DONE

DESCRIPTION = "List the models that come with Epicycle."


def add(command: argparse.ArgumentParser) -> None:
    """``epicycle models`` has no options."""


def run(options: argparse.Namespace, given: list[str]) -> int:
    """Print every packaged model with the first sentence of its doc."""
    from ..model import load_model, packaged_models

    for name, path in packaged_models().items():
        doc = load_model(path).doc
        first, _, _ = doc.partition(". ")
        print(f"{name}: {first}" if doc else name)
    return DONE
