"""Modules that need packages which need not be installed."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from epicycle.actors import EpicycleError

EXTRAS = {  # by which extra each is installed
    "control": "control",
    "fmpy": "fmi",
    "gymnasium": "rl",
    "mcap": "ros",
    "pettingzoo": "rl",
    "rosbags": "ros",
}


def needed(module: str, who: str) -> Any:
    """A module; raises ``EpicycleError`` if a package that it needs is missing."""
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in EXTRAS:
            raise
        raise EpicycleError(
            f"{who} needs the package {package}, which is not installed: pip install 'epicycle[{EXTRAS[package]}]'"
        ) from None
