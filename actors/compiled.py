"""Which core runs: the modules that were compiled when Epicycle was installed, or their Python sources.

Both do the same, to the bit.  A compiled module is beside its source, and Python prefers it.  If the sources have
changed since, or if EPICYCLE_CORE=python is set, all compiled modules are ignored.  This module is imported first, by
the package, and read by ``setup.py``, which builds the core.
"""

from __future__ import annotations

import ast
import hashlib
import json
import os
import sys
from importlib.machinery import ModuleSpec
from importlib.util import spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

# In the order of their imports.  Each costs 2 to 4 s of CPU time at installation.
CORE_MODULES = (
    "epicycle.actors.core.primitives",
    "epicycle.actors.core.tag",
    "epicycle.actors.core.moment",
    "epicycle.actors.core.order",
    "epicycle.actors.core.ports",
    "epicycle.actors.core.parameter",
    "epicycle.actors.core.port_parameter",
    "epicycle.actors.core.actor",
    "epicycle.actors.core.authoring",
    "epicycle.actors.core.process",
    "epicycle.actors.core.random",
    "epicycle.actors.core.laws",
    "epicycle.actors.robotics.arrays",
    "epicycle.actors.robotics.messages",
    "epicycle.actors.robotics.world",
    "epicycle.actors.robotics.monitors",
    "epicycle.actors.robotics.estimator",
    "epicycle.actors.robotics.controller",
    "epicycle.aspects.core.join_point",
    "epicycle.aspects.core.kinds",
    "epicycle.runner.results.record",
    "epicycle.runner.results.log",
    "epicycle.runner.engine.agenda",
    "epicycle.runner.engine.native",
    "epicycle.runner.engine.computing",
    "epicycle.runner.engine.forms",
    "epicycle.runner.engine.director",
    "epicycle.runner.engine.loop",
    "epicycle.runner.engine.way",
    "epicycle.runner.engine.batches",
    "epicycle.runner.engine.statistic",
    "epicycle.runner.engine.measurement",
    "epicycle.runner.engine.listeners",
    "epicycle.runner.engine.aspect_context",
)
MANIFEST = "actors/compiled.json"
CHOICES = ("python", "compiled")


def digests(root: Path) -> dict[str, str]:
    """A digest of the files of each module of the core, by its name; ``root`` is the folder with the packages."""
    found = {}
    for name in CORE_MODULES:
        source = root.joinpath(*name.split(".")[1:])
        files = [source.with_suffix(ending) for ending in (".py", ".pxd", ".pyx")]
        content = b"".join(file.read_bytes() for file in files if file.exists())
        found[name] = hashlib.sha256(content.replace(b"\r\n", b"\n")).hexdigest()
    return found


def text_of(source: Path, name: str) -> str:
    """The text of a class or function without its docstrings; native forms hold a digest of it."""
    text = source.read_text(encoding="utf-8")
    lines = text.splitlines()
    (found,) = (node for node in ast.parse(text).body if getattr(node, "name", "") == name)
    told = [
        range(first.lineno, first.end_lineno + 1)
        for node in ast.walk(found)
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)) and isinstance(first := node.body[0], ast.Expr)
        if isinstance(first.value, ast.Constant) and first.end_lineno is not None
    ]
    return "\n".join(
        lines[number - 1]
        for number in range(found.lineno, (found.end_lineno or found.lineno) + 1)
        if not any(number in each for each in told)
    )


class _Sources:
    """Finds the Python sources of the core's modules instead of the compiled ones."""

    def __init__(self, root: Path) -> None:
        self._root = root

    def find_spec(self, name: str, path: object = None, target: ModuleType | None = None) -> ModuleSpec | None:
        if name not in CORE_MODULES:
            return None
        return spec_from_file_location(name, self._root.joinpath(*name.split(".")[1:]).with_suffix(".py"))


def choose(wanted: str = "") -> tuple[str, str]:
    """Which core the process runs, and the reason if it is Python.

    Raises ``ImportError`` if the requested core does not exist or is not available.
    """
    root = Path(__file__).parents[1]
    if wanted and wanted not in CHOICES:
        raise ImportError(
            f"EPICYCLE_CORE={wanted} is unknown; the cores are {' and '.join(CHOICES)}", name="EPICYCLE_CORE"
        )
    if wanted == "python":
        reason = "chosen by EPICYCLE_CORE"
    else:
        reason = _missing(root)
    if not reason:
        return "compiled", ""
    if wanted == "compiled":
        raise ImportError(f"EPICYCLE_CORE=compiled is not available: {reason}", name="EPICYCLE_CORE")
    finder: Any = _Sources(root)
    sys.meta_path.insert(0, finder)
    return "python", reason


def _missing(root: Path) -> str:
    """Why the compiled core cannot be used; empty if it can."""
    try:
        built = json.loads((root / MANIFEST).read_bytes())
    except (OSError, ValueError):
        return "the core was not compiled at installation; reinstall Epicycle where a C compiler is available"
    if built.get("python") != sys.implementation.cache_tag:
        return f"the core was compiled for {built.get('python')}; reinstall Epicycle"
    if built.get("modules") != digests(root):
        return "the sources have changed since the core was compiled; reinstall Epicycle"
    return ""


CORE, CORE_REASON = ("", "") if __name__ == "setup" else choose(os.environ.get("EPICYCLE_CORE", ""))
