"""Epicycle from Python: load, run, study and compare models, draw and save the results.

>>> import epicycle
>>> results = epicycle.run("mm1", seed=3, set={"load": 0.9})
>>> results.metrics["mean_wait"]
"""

from __future__ import annotations

import ast
from importlib import import_module
from pathlib import Path
from typing import Any

# Where each name is, as __init__.pyi says it: names are looked up on first use, because `import epicycle` must not wait
# for NumPy and networkx.
_HOMES = {
    each.name: node.module
    for node in ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")).body
    if isinstance(node, ast.ImportFrom) and node.module
    for each in node.names
}
_FOLDERS = ("actors", "aspects", "bridges", "runner")

__all__ = sorted(_HOMES)  # noqa: PLE0605


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    if name in _FOLDERS:  # `epicycle.actors.Clock` without a separate import
        return import_module(f"{__name__}.{name}")
    if name == "__version__":
        return import_module(f"{__name__}.runner.study.provenance").version_of("epicycle")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, *_FOLDERS})
