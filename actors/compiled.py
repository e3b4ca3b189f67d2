"""Which core runs: the modules that were compiled when Epicycle was installed, or their Python sources.

Both do the same, to the bit.  The compiled modules lie in a few libraries in ``built``, apart from their sources.  If
the sources have changed since, or if EPICYCLE_CORE=python is set, they are ignored.  This module is imported first, by
the package, and read by ``setup.py``, which builds the libraries.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
from collections.abc import Sequence
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader, ModuleSpec, PathFinder
from importlib.util import spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

# By library, in the order of their imports; each module costs 1 to 3 s of CPU time at installation.
LIBRARIES = {
    "kernel": (
        "epicycle.actors.core.primitives",
        "epicycle.actors.core.tag",
        "epicycle.actors.core.order",
        "epicycle.actors.core.ports",
        "epicycle.actors.core.parameter",
        "epicycle.actors.core.port_parameter",
        "epicycle.actors.core.laws",
        "epicycle.runner.execution.engine.agenda",
        "epicycle.runner.execution.engine.director",
        "epicycle.runner.execution.engine.loop",
        "epicycle.runner.execution.engine.receivers",
    ),
    "record": (
        "epicycle.runner.execution.results.record",
        "epicycle.runner.execution.results.log",
        "epicycle.runner.execution.engine.batches",
        "epicycle.runner.execution.engine.statistic",
        "epicycle.runner.execution.engine.measurement",
    ),
    "forms": ("epicycle.runner.execution.engine.forms",),
    # Pay where thousands of runs are to come.
    "machines": (
        "epicycle.actors.expression.operations",
        "epicycle.actors.modes.borders",
        "epicycle.actors.modes.modal",
        "epicycle.actors.modes.machine",
    ),
    "robots": ("epicycle.actors.robotics.arrays", "epicycle.actors.robotics.history"),
}
CORE_LIBRARIES = ("kernel", "record", "forms")  # the others are built on them
CORE_MODULES = tuple(module for modules in LIBRARIES.values() for module in modules)
FOLDER = "actors/built"
MANIFEST = f"{FOLDER}/manifest.json"
CHOICES = ("python", "compiled")


def digests(root: Path) -> dict[str, str]:
    """A digest of the sources of each library and of those that it is built on; ``root`` has the packages."""
    found = {}
    for library in LIBRARIES:
        content = hashlib.sha256()
        parts = dict.fromkeys((*CORE_LIBRARIES, library))
        for name in (module for part in parts for module in LIBRARIES[part]):
            source = root.joinpath(*name.split(".")[1:])
            for file in (source.with_suffix(ending) for ending in (".py", ".pxd", ".pyx")):
                if file.exists():
                    content.update(f"{name}{file.suffix}".encode())
                    content.update(file.read_bytes().replace(b"\r\n", b"\n"))
        found[library] = content.hexdigest()
    return found


class _Finder:
    """Finds compiled modules in their libraries, and of all others the Python sources.

    A compiled file beside a source is of an earlier build, and Python would prefer it.
    """

    def __init__(self, compiled: dict[str, Path]) -> None:
        self._compiled = compiled

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if not name.startswith("epicycle."):
            return None
        if (library := self._compiled.get(name)) is not None:
            return spec_from_file_location(name, library, loader=ExtensionFileLoader(name, str(library)))
        spec = PathFinder.find_spec(name, path)
        if spec is not None and spec.origin is not None and isinstance(spec.loader, ExtensionFileLoader):
            return spec_from_file_location(name, Path(spec.origin).with_name(f"{name.rpartition('.')[2]}.py"))
        return spec


class OwnSignature:
    """The ``__signature__`` of a class in C, for ``help``: a function's, as text.  Subclasses have their own."""

    def __init__(self, module: str, name: str, text: str) -> None:
        self._owner = (module, name)
        self._text = text

    def __get__(self, instance: object, owner: type) -> Any:
        if (owner.__module__, owner.__name__) != self._owner:
            raise AttributeError("__signature__")
        from inspect import signature

        return signature(eval(self._text, vars(sys.modules[owner.__module__])))


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
        libraries: list[str] = []
        reason = "chosen by EPICYCLE_CORE"
    else:
        libraries, reason = _usable(root)
    if reason and wanted == "compiled":
        raise ImportError(f"EPICYCLE_CORE=compiled is not available: {reason}", name="EPICYCLE_CORE")
    compiled = {module: library_file(root, library) for library in libraries for module in LIBRARIES[library]}
    finder: Any = _Finder(compiled)
    sys.meta_path.insert(0, finder)
    return ("python", reason) if reason else ("compiled", "")


def library_file(root: Path, library: str) -> Path:
    """Where a compiled library is."""
    return root / FOLDER / f"{library}{EXTENSION_SUFFIXES[0]}"


def _usable(root: Path) -> tuple[list[str], str]:
    """The libraries that can be used; without the core, none, and why."""
    try:
        built = json.loads((root / MANIFEST).read_bytes())
        python, libraries = built["python"], dict(built["libraries"])
    except (OSError, ValueError, TypeError, KeyError):
        return [], f"the core is not compiled; {REMEDY}"
    if python != sys.implementation.cache_tag:
        return [], f"the core was compiled for {python}; {REMEDY}"
    current = digests(root)
    usable = [
        library
        for library in LIBRARIES
        if libraries.get(library) == current[library] and library_file(root, library).exists()
    ]
    if not set(CORE_LIBRARIES).issubset(usable):
        return [], f"the sources have changed since the core was compiled; {REMEDY}"
    return usable, ""


REMEDY = "'make core', or an installation with EPICYCLE_BUILD=all, compiles it where there is a C compiler"
CORE, CORE_REASON = ("", "") if __name__ == "setup" else choose(os.environ.get("EPICYCLE_CORE", ""))
