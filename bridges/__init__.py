"""What others have, as parts of a model, and models as parts of what others have.

``processes``: functions and programs written for SimPy.  Bridges use Epicycle's public interface only.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .processes import Environment, Process, process

__all__ = ["Environment", "Process", "process"]

_HOMES = {"processes": ("Environment", "Process", "process")}


def __getattr__(name: str) -> Any:
    # On first use: most need a package of their own.
    home = next((home for home, names in _HOMES.items() if name in names), None)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{home}", __name__), name)
