"""`--types`: actors and aspects of a file that the user names."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from epicycle.runner.interface.cli import main

ACTORS = """
from helpers_of_mine import FACTOR
from epicycle.actors import Actor, Clock, InputPort, OutputPort
from epicycle.aspects import CommunicationAspect

class _Hidden(Actor):
    pass

class Double(Actor):
    "Sends twice what comes."
    input = InputPort(float)
    output = OutputPort(float)

    def fire(self) -> None:
        for token in self.input.tokens:
            self.output.send(FACTOR * token)

class Swallow(CommunicationAspect):
    "Swallows what is greater than two."
    events = ("swallowed",)

    def pass_token(self, token, point):
        point.forward(token) if token <= 2 else point.act("swallowed", token)
"""

MODEL = """
model: m
actors: {clock: {type: Clock, period: 1}, double: {type: Double}}
connections: [clock.output -> double.input]
aspects: {gone: {type: Swallow, at: double.input}}
run: {stop: 5}
metrics: {largest: {of: double.output, take: max}}
"""


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.chdir(tmp_path)
    Path("mine").mkdir()
    Path("mine/actors_of_mine.py").write_text(ACTORS, encoding="utf-8")
    Path("mine/helpers_of_mine.py").write_text("FACTOR = 2", encoding="utf-8")
    Path("m.yaml").write_text(MODEL, encoding="utf-8")
    before, path = set(sys.modules), list(sys.path)
    yield
    assert sys.path == path
    for name in set(sys.modules) - before:
        if name.endswith("_of_mine"):
            del sys.modules[name]


def test_types_are_known_to_all_commands(capsys: pytest.CaptureFixture[str]) -> None:
    types = ("--types", "mine/actors_of_mine.py")
    assert main(["run", "m.yaml", "--json", *types]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert (printed["metrics"], printed["aspects"]) == ({"largest": 4.0}, {"gone": {"swallowed": 3}})
    assert main(["validate", "m.yaml", *types]) == 0
    assert main(["describe", "m.yaml", "--aspects", *types]) == 0
    assert main(["list", "aspects", *types]) == 0
    printed = capsys.readouterr().out
    assert "Swallows what is greater than two" in printed
    assert main(["list", "actors", *types]) == 0
    printed = capsys.readouterr().out
    assert "Sends twice what comes" in printed
    assert "_Hidden" not in printed
    assert main(["list", "schema", *types]) == 0
    assert '"Double"' in capsys.readouterr().out


def test_without_types_the_model_is_wrong(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", "m.yaml"]) == 2
    assert "double: there is no actor type 'Double'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("file", "text", "message"),
    [
        ("gone_of_mine.py", None, "there is no such file"),
        ("of_mine.txt", "", "expected a Python file such as my_actors.py, or an FMU"),
        ("of-mine.py", "", "expected a Python file such as my_actors.py, or an FMU"),
        (
            "none_of_mine.py",
            "from epicycle.actors import Clock",
            (
                "the file defines no actor, no aspect, no part such as an Objective, and no function with a parameter "
                "'env'"
            ),
        ),
        ("bad_of_mine.py", "x = 1\n1 / 0", "ZeroDivisionError: division by zero (line 2)"),
        ("exit_of_mine.py", "raise SystemExit(3)", "SystemExit: 3 (line 1)"),
        ("json.py", "", "another module is called 'json'; give the file another name"),
    ],
)
def test_a_file_that_cannot_be_had(
    file: str, text: str | None, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    if text is not None:
        Path(file).write_text(text, encoding="utf-8")
    assert main(["validate", "m.yaml", "--types", file]) == 2
    assert capsys.readouterr().err == f"error: --types {file}: {message}\n"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("raise SystemExit(3)", "SystemExit: 3 (line 1)"),
        ("class Own(BaseException): pass\nraise Own('x')", "Own: x (line 2)"),
        ("class Own(KeyboardInterrupt): pass\nraise Own('x')", "Own: x (line 2)"),
        ("raise GeneratorExit", "GeneratorExit:  (line 1)"),
        (
            "import sys\ndel sys.modules[__name__]\ngetattr(sys, 'path').pop(0)\n1 / 0",
            "ZeroDivisionError: division by zero (line 4)",
        ),
    ],
)
def test_whatever_a_file_raises(text: str, told: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("raising_of_mine.py").write_text(text)
    Path("m.yaml").write_text("model: m\n")
    assert main(["validate", "m.yaml", "--types", "raising_of_mine.py"]) == 2
    assert capsys.readouterr().err == f"error: --types raising_of_mine.py: {told}\n"


def test_a_command_ends_though_a_thread_of_the_run_does_not() -> None:
    Path("threads_of_mine.py").write_text(
        "import threading\nfrom epicycle.actors import Actor\n\nclass Starter(Actor):\n    def fire(self): pass\n\n"
        "    def initialize(self):\n        threading.Thread(target=threading.Event().wait, name='mine').start()\n"
    )
    Path("m.yaml").write_text("model: m\nactors: {a: {type: Starter}}\nrun: {stop: 1}\n")
    command = [
        sys.executable,
        "-m",
        "epicycle.runner.interface.cli",
        "run",
        "m.yaml",
        "--types",
        "threads_of_mine.py",
        "--json",
    ]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0
    assert done.stderr.endswith("threads that the run started are still running and are ended: mine\n")
