"""Ptolemy II: imports its models, and runs them by its rules.  A plug-in: nothing else in Epicycle knows it.

``from epicycle.ptolemy import Queue`` is the actor of that name under ``like: ptolemy``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .importing import Imported, MomlError, import_moml

__all__ = ["Imported", "MomlError", "import_moml"]


def __getattr__(name: str) -> Any:
    # On first use: `epicycle --help` must not wait for the importer.
    if name in __all__:
        from . import importing

        return getattr(importing, name)
    if name[:1].isupper():
        from .dialect import Ptolemy

        for each in Ptolemy.types():
            if each.__name__ == name:
                return each
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
