"""Native forms do what the actors do whose forms they are; see runner/execution/engine/forms.pyx."""

from __future__ import annotations

import ast
import hashlib
from pathlib import Path

import pytest

from tests.engine.cores import ROOT

# The sources of which the forms are forms, with digests.  Where one has changed, make the form do the same, check that
# with `make cores`, and write the new digest here.
SOURCES = (
    ("arithmetic.py", "Scale", "7f39ca54f30a01c2"),
    ("core/authoring.py", "Latest", "7b8df371609d0b11"),
    ("core/authoring.py", "Pending", "2c2a047606f97709"),
    ("core/authoring.py", "rounds", "bcf677d00b681776"),
    ("core/elementary/logarithm.py", "log", "25dc7d4323f94b34"),
    ("core/laws.py", "exponential", "dd3e701d840f2744"),
    ("core/laws.py", "gamma", "da1afffdbd29a311"),
    ("core/laws.py", "normal", "c6bfa77a937cc231"),
    ("core/laws.py", "uniform", "36b3b17c5a3d5e40"),
    ("core/port_parameter.py", "ParameterPort", "b1efbd3445a35318"),
    ("core/tag.py", "to_nanoseconds", "92eec895841c04b6"),
    ("core/tag.py", "to_seconds", "f6c6aae6371c52a3"),
    ("distributions.py", "Constant", "e6f123317132cd9d"),
    ("distributions.py", "Exponential", "c23d8bd9634f01e6"),
    ("distributions.py", "Gamma", "a02963690b8f422f"),
    ("distributions.py", "Normal", "41b7f712051a423b"),
    ("distributions.py", "Uniform", "6d1f653751253aab"),
    ("functions.py", "Expression", "04f953415b946d4b"),
    ("queues.py", "Server", "d03a0ba88d5e6312"),
    ("sources.py", "Clock", "dea6cfe22e657223"),
    ("sources.py", "PoissonClock", "1325a600f09fbe16"),
    ("sources.py", "Random", "af946011992e877e"),
    ("sources.py", "_Ticking", "629fb0b699c7a779"),
    ("timing.py", "TimeDelay", "d85c8774a78d5cff"),
)


def text_of(source: Path, name: str) -> str:
    """The text of a class or function without its docstrings."""
    lines = source.read_text(encoding="utf-8").splitlines()
    (found,) = (node for node in ast.parse("\n".join(lines)).body if getattr(node, "name", "") == name)
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


@pytest.mark.parametrize(("file", "name", "digest"), SOURCES)
def test_a_form_is_of_the_source_that_there_is(file: str, name: str, digest: str) -> None:
    text = text_of(ROOT / "actors" / file, name)
    assert hashlib.sha256(text.encode()).hexdigest()[:16] == digest


def test_what_a_form_is_a_form_of(tmp_path: Path) -> None:
    """Docstrings do not count, whatever else stands first does."""
    source = tmp_path / "one.py"
    kind = 'class A:\n    """Doc."""\n    def fire(self):\n        self.send(1)\n'
    source.write_text(f'{kind}\n\ndef f(x):\n    """Doc."""\n    return x\n')
    assert text_of(source, "A") == "class A:\n    def fire(self):\n        self.send(1)"
    assert text_of(source, "f") == "def f(x):\n    return x"
