"""Printing: text of models is never obeyed or read as markup, and every stream will do, however limited."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from epicycle.actors import Clock, Display, EpicycleError, Parameter, readable, shortened, visible, visible_lines
from epicycle.actors.core.messages import LONGEST
from epicycle.runner import Model, ModelError, Simulation, load_model
from epicycle.runner.interface.cli import main

# Escape sequences for colour and for the title of the window, a bell, text that runs backwards, the 8-bit form of an
# escape sequence, and what rich takes for the end of a style.
EVIL = "[/b]\x1b[31m\x1b]0;title\x07\u202e\x9b[/foo] :smile:"
CLEAN = r"[/b]\x1b[31m\x1b]0;title\x07\u202e\x9b[/foo] :smile:"
MODEL = f"""
model: m
doc: {json.dumps(EVIL)}
actors:
  clock: {{type: Clock, period: 1, values: {json.dumps([EVIL])}}}
  shown: {{type: Display, title: {json.dumps(EVIL)}}}
connections: [clock.output -> shown.input]
run: {{stop: 1}}
metrics: {{what: {{of: clock.output, take: last, unit: "[/b]\\e[3m", doc: "[/foo]\\a"}}}}
"""


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("m.yaml").write_text(MODEL, encoding="utf-8")


def test_a_run_prints_text_as_text(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "m.yaml"]) == 0
    printed = capsys.readouterr()
    (row,) = [line for line in printed.out.splitlines() if line.startswith("what")]
    assert row.split() == ["what", *CLEAN.split(), r"[/b]\x1b[3m", r"[/foo]\x07"]
    assert [line.rstrip() for line in printed.err.splitlines()] == [f"{time} s  {CLEAN}: {CLEAN}" for time in (0, 1)]
    assert all(line.isprintable() for line in (*printed.out.splitlines(), *printed.err.splitlines()))


def test_json_stays_exact(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "m.yaml", "--json"]) == 0
    printed = capsys.readouterr().out
    assert json.loads(printed)["metrics"] == {"what": EVIL}
    assert printed.rstrip("\n").isprintable()
    assert main(["run", "m.yaml", "--json", "--trace", "clock"]) == 0
    printed = capsys.readouterr().out
    assert [json.loads(line)["sends"][0]["token"] for line in printed.splitlines()] == [EVIL, EVIL]
    assert all(line.isprintable() for line in printed.splitlines())


@pytest.mark.parametrize("command", ["run --trace", "graph", "validate", "describe --aspects", "describe"])
def test_other_commands_print_text_as_text(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command.split(maxsplit=1)[0], "m.yaml", *command.split()[1:]]) == 0
    printed = capsys.readouterr()
    assert all(line.isprintable() for line in (*printed.out.splitlines(), *printed.err.splitlines()))


def test_what_is_no_model_is_told_in_clean_words(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["describe", EVIL.replace("/", "")]) == 2
    assert capsys.readouterr().err == (
        f"error: there is no type or packaged model {CLEAN.replace('/', '').replace(chr(92), chr(92) * 2)!r}\n".replace(
            chr(92) * 4, chr(92)
        )
        + "   help: 'epicycle list models', 'epicycle list actors' and 'epicycle list aspects' list them\n"
        + "   help: for your own types, add '--types FILE.py'\n"
    )


def test_display_and_tables_outside_of_the_command_line(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO", "epicycle.display")
    model = Model(EVIL, stop=0)
    clock, display = model.add(Clock("clock", period=1, values=[EVIL])), model.add(Display("display", title=EVIL))
    model.connect(clock.output, display.input)
    Simulation(model).run()
    assert caplog.messages == [f"0 s  {CLEAN}: {CLEAN}"]
    assert str(model).startswith(f"{CLEAN}: 2 actors, 1 connection, 0 aspects")
    assert all(line.isprintable() for line in str(model).splitlines())


class Ascii(io.TextIOWrapper):
    """A terminal with only ASCII."""

    def __init__(self) -> None:
        super().__init__(io.BytesIO(), encoding="ascii")

    def text(self) -> str:
        self.flush()
        return self.buffer.getvalue().decode("ascii")  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("arguments", "check"),
    [
        (["run", "umlaut.yaml"], lambda text: r"K\xe4fer \U0001f41e" in text),
        (["run", "umlaut.yaml", "--json"], lambda text: json.loads(text)["metrics"] == {"what": "Käfer 🐞"}),
        (["graph", "collision_avoidance"], lambda text: r"\xabpacket_loss\xbb" in text),
        (["list", "schema"], lambda text: len(json.loads(text)) > 5),
        (["status", "out"], lambda text: text.startswith(r"studie: 2 of 2 runs are finished (2 ok)")),
        (["status", "out", "--conditions"], lambda text: r"(t=K\xe4fer): 1 ok of 1" in text),
        (["describe", "PacketLoss"], lambda text: "PacketLoss" in text),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_a_terminal_in_ascii(
    arguments: list[str], check: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    model = MODEL.replace(json.dumps([EVIL]), '["Käfer 🐞"]').replace(json.dumps(EVIL), '"σ of the Käfer"')
    Path("umlaut.yaml").write_text(model, encoding="utf-8")
    if arguments[0] == "status":
        text = model.replace("model: m", "model: m\nparameters: {t: {value: x}}").replace('["Käfer 🐞"]', '["${t}"]')
        Path("umlaut.yaml").write_text(text, encoding="utf-8")
        study = "study: studie\nmodel: umlaut.yaml\nvary: {t: [Käfer, σ]}\nmetrics: {n: events}\n"
        Path("s.yaml").write_text(study, encoding="utf-8")
        assert main(["study", "s.yaml", "--out", "out", "--jobs", "1"]) == 0
    stdout, stderr = Ascii(), Ascii()
    monkeypatch.setattr(sys, "stdout", stdout)
    monkeypatch.setattr(sys, "stderr", stderr)
    assert main(arguments) == 0
    assert check(stdout.text()), stdout.text()


def test_streams_that_are_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdout", None)
    monkeypatch.setattr(sys, "stderr", None)
    monkeypatch.setattr(sys, "stdin", None)
    assert main(["run", "m.yaml", "--out", "out"]) == 0
    assert Path("out/manifest.json").is_file()
    assert main(["graph", "m.yaml"]) == 0
    assert main(["describe", "Clok"]) == 2


@pytest.mark.skipif(os.name == "nt", reason="a shell of Unix")
def test_the_program_with_closed_or_full_streams() -> None:
    program = f"{sys.executable} -m epicycle.runner.interface.cli"
    closed = f"{program} run m.yaml --out out >&- 2>&- <&-"
    done = subprocess.run(closed, shell=True, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert json.loads(Path("out/manifest.json").read_text("utf-8"))["events"] == 2
    if Path("/dev/full").exists():
        full = f"{program} graph m.yaml >/dev/full"
        done = subprocess.run(full, shell=True, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (1, "error: [Errno 28] No space left on device\n")


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("plain text", "plain text"),
        ("Käfer, σ, 測定", "Käfer, σ, 測定"),
        ("a\tb\nc", "a\\tb\\nc"),
        ("\x1b]0;x\x07\x7f\x80\x9b", "\\x1b]0;x\\x07\\x7f\\x80\\x9b"),
        ("\u202e\u2066\u200b\ufeff", "\\u202e\\u2066\\u200b\\ufeff"),
        ("\ud800 \U000e0001", "\\ud800 \\U000e0001"),
        ("\u2028\u2029", "\\u2028\\u2029"),
    ],
)
def test_visible(text: str, shown: str) -> None:
    assert visible(text) == shown
    assert visible_lines(f"{text}\n") == shown.replace("\\n", "\n") + "\n"
    assert visible(shown) == shown


def test_long_texts_are_cut() -> None:
    assert shortened("a" * LONGEST) == "a" * LONGEST
    assert shortened("a" * 590_000) == f"{'a' * 1700} ... (588,000 characters left out) ... {'a' * 300}"
    assert readable(f"{'a' * 5000}\nb\x1b") == f"{'a' * 1700} ... (3,000 characters left out) ... {'a' * 300}\nb\\x1b"


def test_a_list_of_very_many_names_is_cut() -> None:
    names = ", ".join(f"robot_of_the_fleet_{index}" for index in range(2000))
    actors = "\n".join(f"  {name}: {{type: Clock, period: 1}}" for name in names.split(", "))
    Path("many.yaml").write_text(f"model: many\nactors:\n{actors}\n", encoding="utf-8")
    model = load_model("many.yaml")
    with pytest.raises(ModelError) as caught:
        model.remove("sensor")
    (problem,) = caught.value.problems
    listed = f"valid actors: {names}"
    assert problem.help == (listed,)
    left = f"{len(listed) - LONGEST:,} characters left out"
    assert str(problem).splitlines()[-1] == f"   help: {listed[:1700]} ... ({left}) ... {listed[-300:]}"


class Told(Clock):
    """Fails with a token in its words."""

    depth = Parameter(int, 40_000)

    def fire(self) -> None:
        token: Any = [list(range(100))] * (self.depth // 100)
        raise EpicycleError(f"{token} is too much")


def test_a_very_long_token_is_cut() -> None:
    model = Model("m", stop=1)
    model.add(Told("told", period=1))
    with pytest.raises(EpicycleError) as caught:
        Simulation(model).run()
    first, *_ = str(caught.value).splitlines()
    assert first.startswith("told failed in fire() at (0 s, 1): [[0, 1, 2, 3, 4, 5,")
    assert first.endswith("97, 98, 99]] is too much")
    assert "characters left out" in first
    assert len(first) < 2100
