"""What others have, as parts of a model, and models as parts of what others have.

``processes``: functions and programs written for SimPy.  ``learning``: models as environments of Gymnasium and
PettingZoo.  ``bags``: recordings of ROS 2.  ``fmi``: FMUs.  ``systems``: systems of python-control.  Bridges use
Epicycle's public interface only.
"""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Any

from epicycle.runner.support.extras import needed

# Where each name is, as __init__.pyi says it: names are looked up on first use, as most need a package of their own.
_HOMES = {
    each.name: f"{__name__}.{node.module}"
    for node in ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")).body
    if isinstance(node, ast.ImportFrom)
    for each in node.names
}

__all__ = sorted(_HOMES)  # noqa: PLE0605


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(needed(_HOMES[name], name), name)
