"""Modules that need packages which need not be installed."""

from __future__ import annotations

from importlib import import_module
from typing import Any

EXTRAS = {  # by which extra each is installed
    "anyio": "studio",
    "control": "control",
    "fmpy": "fmi",
    "foxglove": "mcap",
    "gymnasium": "rl",
    "lsprotocol": "editor",
    "mcap": "ros",
    "mcp": "agents",
    "mcp_types": "agents",
    "pettingzoo": "rl",
    "pydantic": "agents",
    "pygls": "editor",
    "rerun": "rerun",
    "rosbags": "ros",
    "starlette": "studio",
    "uvicorn": "studio",
    "websockets": "studio",
    "yaml_edit": "studio",
}
DISTRIBUTIONS = {"foxglove": "foxglove-sdk", "rerun": "rerun-sdk"}  # of packages that are installed by other names


def needed(module: str, who: str, extra: str = "") -> Any:
    """A module; raises ``EpicycleError`` if a package that it needs is missing, which may come with an ``extra``."""
    try:
        return import_module(module)
    except ImportError as error:  # of the package, or of something that an older one lacks
        package = (error.name or "").partition(".")[0]
        if package not in EXTRAS:
            raise
        from epicycle.actors import EpicycleError  # here, because help needs nothing heavy

        raise EpicycleError(
            f"{who} needs the package {DISTRIBUTIONS.get(package, package)}, which is not installed: "
            f"pip install 'epicycle[{extra or EXTRAS[package]}]'"
        ) from None
