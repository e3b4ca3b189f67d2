"""list the actors, or describe one"""

from __future__ import annotations

import argparse

from .options import DONE, add_types, own_types
from .reference import add_json, print_reference

DESCRIPTION = "List the actors that a model may use, or describe one: its ports and parameters."


def add(command: argparse.ArgumentParser) -> None:
    """The options of ``epicycle actors``."""
    command.add_argument("name", metavar="NAME", nargs="?", help="an actor type")
    add_types(command)
    add_json(command)


def run(options: argparse.Namespace, given: list[str]) -> int:
    """Print the reference."""
    from ..catalogue import installed

    known = installed().with_types(own_types(options))
    print_reference(known.actors, known.aspects, "actor", options.name, options.json)
    return DONE
