"""list the aspects, describe one, or show where they stand in a model"""

from __future__ import annotations

import argparse

from ..printing import console, tell_json
from .options import DONE, add_changes, load, own_types
from .reference import add_json, print_reference

DESCRIPTION = (
    "List the aspects that a model may use, describe one, or show which aspects stand at the ports of a model, in the "
    "order in which a token meets them."
)


def add(command: argparse.ArgumentParser) -> None:
    """The options of ``epicycle aspects``."""
    command.add_argument(
        "model",
        metavar="NAME or MODEL",
        nargs="?",
        help="an aspect type, a packaged model, or a path to a YAML file",
    )
    add_changes(command)
    add_json(command)


def run(options: argparse.Namespace, given: list[str]) -> int:
    """Print the reference, or a model's aspects."""
    from epicycle.actors import EpicycleError

    from ..catalogue import installed, is_path, packaged_models

    known = installed().with_types(own_types(options))
    name, types, models = options.model, known.aspects, packaged_models()
    if name is None or name in types or not (name in models or is_path(name)):
        if options.set or options.overrides or options.disturb or options.aspect or options.without:
            raise EpicycleError("--set, --overrides, --disturb, --aspect and --without change a model: name one")
        print_reference(types, known.actors, "aspect", name, options.json, also=models)
        return DONE
    from ..show import aspects_at, weaving

    model = load(options)
    if options.json:
        tell_json(aspects_at(model), indent=2)
    else:
        console().print(weaving(model))
    return DONE
