"""Modules import one way, and each of them under one name."""

import ast
import json
import os
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.shipped import CODE_FOLDERS, FOLDERS, ROOT, module_name, shipped_files


def imported_names(text: str, file: Path) -> Iterator[tuple[int, str]]:
    """Yield the line and the absolute dotted name of everything that a module imports."""
    package = ["epicycle", *file.parent.parts]
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield node.lineno, alias.name
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            base = [*base, *(node.module.split(".") if node.module else [])]
            for alias in node.names:
                yield node.lineno, ".".join([*base, alias.name])


def forbidden_imports(text: str, file: Path) -> list[str]:
    """Return a line for each import in a module that goes the wrong way or past the name epicycle."""
    above = CODE_FOLDERS[CODE_FOLDERS.index(file.parts[0]) + 1 :]
    found = []
    for line, name in imported_names(text, file):
        first, _, rest = name.partition(".")
        folder = rest.partition(".")[0] if first == "epicycle" else ""
        if folder in above or first in FOLDERS:
            found.append(f"{file.as_posix()}:{line} imports {name}")
    return found


@pytest.mark.slow
def test_imports_go_one_way() -> None:
    found = [
        problem
        for file in shipped_files()
        if file.suffix == ".py" and file.parts[0] in CODE_FOLDERS
        for problem in forbidden_imports((ROOT / file).read_text("utf-8"), file)
    ]
    assert found == []


@pytest.mark.parametrize(
    ("file", "line", "name"),
    [
        ("actors/flow.py", "import epicycle.aspects", "epicycle.aspects"),
        ("actors/flow.py", "from epicycle import runner", "epicycle.runner"),
        ("actors/flow.py", "from epicycle.aspects import Aspect", "epicycle.aspects.Aspect"),
        ("actors/flow.py", "from .. import aspects", "epicycle.aspects"),
        ("actors/__init__.py", "from ..runner import run", "epicycle.runner.run"),
        ("actors/core/ports.py", "from ...aspects.core import Aspect", "epicycle.aspects.core.Aspect"),
        (
            "aspects/core/port.py",
            "from epicycle.runner.execution.engine import Director",
            "epicycle.runner.execution.engine.Director",
        ),
        ("runner/interface/cli.py", "import actors", "actors"),
        ("runner/interface/cli.py", "from models import robots", "models.robots"),
    ],
)
def test_an_import_the_wrong_way_is_found(file: str, line: str, name: str) -> None:
    assert forbidden_imports(f"if True:\n    {line}\n", Path(file)) == [f"{file}:2 imports {name}"]


@pytest.mark.parametrize(
    ("file", "line"),
    [
        ("actors/core/ports.py", "from ..core import Tag"),
        ("actors/core/ports.py", "from . import Tag"),
        ("aspects/core/port.py", "from epicycle.actors import Actor"),
        ("runner/interface/cli.py", "from .model import actors"),
        ("runner/model/build/load.py", "from epicycle.aspects import Aspect"),
    ],
)
def test_an_import_the_right_way_is_not(file: str, line: str) -> None:
    assert forbidden_imports(line, Path(file)) == []


@pytest.mark.slow
def test_nothing_is_imported_twice() -> None:
    """Look in a fresh interpreter started at the root, where a bare `import actors` would work too."""
    script = f"""
        import importlib, json, pkgutil, sys
        for folder in {[f"epicycle.{name}" for name in FOLDERS[:-1]]!r}:
            package = importlib.import_module(folder)
            for module in pkgutil.walk_packages(package.__path__, folder + "."):
                if not module.name.endswith("__main__"):
                    importlib.import_module(module.name)
        print(json.dumps({{n: getattr(m, "__file__", None) for n, m in sys.modules.items()}}))
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script)],
        cwd=ROOT,
        env={**os.environ, "EPICYCLE_CORE": "python"},  # compiled modules are files of another name
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    names: dict[str, list[str]] = {}
    for name, file in json.loads(done.stdout.splitlines()[-1]).items():
        path = Path(file).resolve() if file else None
        if path and path.is_relative_to(ROOT) and path.relative_to(ROOT).parts[0] in FOLDERS:
            names.setdefault(path.relative_to(ROOT).as_posix(), []).append(name)
    expected = {
        file.as_posix(): [module_name(file)]
        for file in shipped_files()
        if file.suffix == ".py" and file.stem != "__main__"
    }
    assert names == expected
