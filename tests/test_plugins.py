"""Epicycle without its plug-ins, and what may not occur outside of them."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.plugins import ABSENT, ROOT, copied, main

HOUSE = ("actors", "aspects", "api", "bridges", "runner")
# What belongs to Ptolemy's room: its rules, its actors' ways, the order of posting, Java's generators.
WORDS = re.compile(
    r"ptolemy\s*=|like: ptolemy|one_at_a_time|whole_channel|set_last|follow_ptolemy|are_ptolemys|are_posted|"
    r"\bPosts\b|\bPoster\b|[pP]osted|takes_all|fires_for_nothing|\bBorder\b|is_refired|"
    r"JavaRandom|\bDRand\b|moml|MoML|epicycle\.ptolemy|from \.*ptolemy"
)


def sources() -> list[Path]:
    """All that belongs to the house."""
    found = [path for folder in HOUSE for path in (ROOT / folder).rglob("*") if path.suffix in (".py", ".pyx", ".pxd")]
    return sorted(path for path in found if "__pycache__" not in path.parts)


def test_no_word_of_ptolemy_s_room_outside_of_it() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in sources()
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if WORDS.search(line)
    ]
    assert found == []
    assert len(sources()) > 300


def named(path: Path) -> Iterator[str]:
    """What a module names or says that is not a docstring."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    docs = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef))
        and node.body
        and isinstance(node.body[0], ast.Expr)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docs:
            yield node.value
        yield from (str(getattr(node, name)) for name in ("id", "attr", "arg", "name", "module") if hasattr(node, name))


@pytest.mark.slow
def test_ptolemy_is_a_source_in_docstrings_and_nothing_else() -> None:
    """Nothing that runs knows it."""
    assert [str(path) for path in sources() if path.suffix == ".py" for each in named(path) if "tolemy" in each] == []


PROGRAM = """
import json
from epicycle.runner import Simulation, load_model
from epicycle.runner.model.catalogue.like import dialects
from epicycle.runner.interface.commands import commands
from epicycle.runner.model.text.problems import ModelError
found = {"commands": [each.name for each in commands()], "dialects": [*dialects()]}
found["digest"] = Simulation(load_model("mm1"), seed=1).run(until=1000).digest
open("m.yaml", "w").write("model: m\\ndirector: {like: ptolemy}\\n")
try:
    load_model("./m.yaml")
except ModelError as error:
    found["error"] = error.problems[0].message
try:
    import epicycle.ptolemy
except ImportError as error:
    found["import"] = str(error)
print(json.dumps(found))
"""


@pytest.mark.skipif(bool(ABSENT), reason="there are none")
def test_epicycle_without_plugins(tmp_path: Path) -> None:
    from epicycle.runner import Simulation, load_model
    from epicycle.runner.interface.commands import COMMANDS

    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], cwd=tmp_path, env=copied(tmp_path), capture_output=True, text=True, check=False
    )
    assert done.stderr == ""
    assert json.loads(done.stdout) == {
        "commands": [each.name for each in COMMANDS],
        "dialects": ["epicycle"],
        "digest": Simulation(load_model("mm1"), seed=1).run(until=1000).digest,
        "error": "m: director.like: 'ptolemy' is not one of epicycle",
        "import": "No module named 'epicycle.ptolemy'",
    }


@pytest.mark.slow
def test_tests_pass_without_plugins() -> None:
    """Those that plug-ins could matter to; ``python -m tests.plugins`` runs all."""
    parts = ("catalogue", "commands", "conformance", "language", "engine/test_directors.py", "fuzz/test_hostile.py")
    parts += (
        "test_imports.py",
        "test_packaging.py",
        "test_reference.py",
        "test_docs.py",
        "test_plugins.py",
        "actors/test_variables.py",
    )
    assert main(["-m", "not slow", *(f"tests/{part}" for part in parts)]) == 0
