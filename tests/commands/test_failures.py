"""Python code of users that fails is told with its line; the traceback comes with --debug, and nothing else is lost."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from epicycle.runner import ModelError, load_model
from epicycle.runner.interface.cli import main

OWN = """\
from epicycle.actors import Actor, InputPort, OutputPort, Parameter, Process
from epicycle.aspects import ClockAspect, CommunicationAspect
from epicycle.runner.show import Figure


class Faulty(Actor):
    input = InputPort(float)
    how = Parameter(str, "")

    def __init__(self, path, **parameters):
        super().__init__(path, **parameters)
        if self.how == "constructor":
            {}["gone"]

    def initialize(self):
        if self.how == "initialize":
            self.count += 1

    def fire(self):
        if self.how == "fire":
            helper(self.input.value)

    def wrapup(self):
        if self.how == "wrapup":
            raise OSError("no paper")


def helper(value):
    return 1 / (value - value)


class Worker(Process):
    how = Parameter(str, "")

    def run(self):
        yield self.wait(1)
        if self.how == "run":
            int("käfer" + str(self.now))


class Odd(CommunicationAspect):
    how = Parameter(str, "")

    def __init__(self, **values):
        super().__init__(**values)
        if self.how == "aspect":
            raise RuntimeError("too odd")

    def pass_token(self, token, point):
        if self.how == "pass_token":
            point.nothing()
        if self.how == "later":
            point.forward(token, delay="long")
        point.forward(token)

    def pass_by(self, token, point):
        if self.how == "pass_by":
            raise LookupError
        point.forward(token)

    def report(self, shared, end):
        return shared["nothing"] if self.how == "report" else {}


class Watch(ClockAspect):
    how = Parameter(str, "")

    def error(self, random):
        if self.how == "clock":
            return random.nothing
        return 0, 1


class Picture(Figure):
    how = Parameter(str, "")

    def signal_patterns(self):
        if self.how == "patterns":
            raise RuntimeError("no signals")
        return ()

    def draw(self, results, path):
        path.write_text("half of a picture")
        if self.how == "draw":
            results.signals["nothing"]
"""
MODEL = """\
model: own
parameters: {how: {value: ""}}
actors:
  clock: {type: Clock, period: 1}
  faulty: {type: Faulty, how: "${how}"}
  worker: {type: Worker, how: "${how}"}
connections: [clock.output -> faulty.input]
aspects:
  odd: {type: Odd, how: "${how}", at: faulty.input, from: "${0 if how != 'pass_by' else 2}"}
  watch: {type: Watch, how: "${how}", at: clock}
run: {stop: 3, record: [clock.output]}
figures:
  whole: {type: TimeSeries, signals: [clock.output]}
  picture: {type: Picture, how: "${how}"}
"""


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.chdir(tmp_path)
    Path("own_of_mine.py").write_text(OWN, encoding="utf-8")
    Path("m.yaml").write_text(MODEL, encoding="utf-8")
    yield
    sys.modules.pop("own_of_mine", None)
    gc.collect()  # or others would find its figure among the types that there are


def raised(code: str, part: str = "") -> str:
    """What is said of the line of that code, of which a part has failed."""
    (line,) = [line for line, text in enumerate(OWN.splitlines(), 1) if text.strip() == code]
    source = OWN.splitlines()[line - 1]
    column = source.index(part or code)
    carets = "^" * len(part or code)
    return f"   raised at own_of_mine.py:{line}:{column + 1}\n{line:>5} | {source}\n      | {'':>{column}}{carets}\n"


def at(line: int, part: str) -> str:
    """The line of the model file with carets below a part of it."""
    source = MODEL.splitlines()[line - 1]
    column = source.index(part)
    return f"{line:>5} | {source}\n      | {'':>{column}}{'^' * len(part)}\n"


FIRE = raised("return 1 / (value - value)", "1 / (value - value)")
RUNNING = {
    "initialize": "error: faulty failed in initialize() at (0 s, 1): AttributeError: 'Faulty' object has no attribute "
    f"'count'\n{raised('self.count += 1', 'self.count')}   declared at m.yaml:5:3\n",
    "fire": f"error: faulty failed in fire() at (0 s, 1): ZeroDivisionError: division by zero\n{FIRE}"
    "   declared at m.yaml:5:3\n",
    "wrapup": "error: faulty failed in wrapup() at (3 s, 2): OSError: no paper\n"
    + raised('raise OSError("no paper")')
    + "   declared at m.yaml:5:3\n",
    "run": "error: worker failed in run() at (1 s, 1): ValueError: invalid literal for int() with base 10: "
    "'käfer1.0'\n" + raised('int("käfer" + str(self.now))') + "   declared at m.yaml:6:3\n",
    "pass_token": "error: aspect odd failed in pass_token() at faulty.input at (0 s, 1): AttributeError: 'JoinPoint' "
    f"object has no attribute 'nothing'\n{raised('point.nothing()', 'point.nothing')}   declared at m.yaml:9:3\n",
    "pass_by": "error: aspect odd failed in pass_by() at faulty.input at (0 s, 1): LookupError\n"
    f"{raised('raise LookupError')}   declared at m.yaml:9:3\n",
    "report": "error: aspect odd failed in report() at (3 s, 2): KeyError: 'nothing'\n"
    + raised('return shared["nothing"] if self.how == "report" else {}', 'shared["nothing"]')
    + "   declared at m.yaml:9:3\n",
}
REFUSED = {
    "constructor": f"m.yaml:5:3: error: faulty: KeyError: 'gone'\n{at(5, 'faulty')}" + raised('{}["gone"]'),
    "aspect": f"m.yaml:9:3: error: aspect odd: RuntimeError: too odd\n{at(9, 'odd')}"
    + raised('raise RuntimeError("too odd")'),
    "patterns": f"m.yaml:14:19: error: figure picture: RuntimeError: no signals\n{at(14, 'Picture')}"
    + raised('raise RuntimeError("no signals")'),
}


def run(how: str, *more: str) -> int:
    return main(["run", "m.yaml", "--types", "own_of_mine.py", "--set", f"how={how}", "--out", "out", *more])


@pytest.mark.parametrize("how", RUNNING)
def test_what_fails_in_a_run_is_told_with_its_line(how: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(how) == 1
    assert capsys.readouterr().err == "what was recorded before is in out\n" + RUNNING[how]
    assert Path("out/signals.parquet").is_file()
    assert run(how, "--debug") == 1
    replaced, kept, said = capsys.readouterr().err.split("\n", 2)
    command = f"epicycle run m.yaml --types own_of_mine.py --set how={how} --out out"
    assert replaced == f"replacing the results of '{command}' in out"
    assert kept == "what was recorded before is in out"
    assert said.startswith("Traceback (most recent call last):\n")
    assert said.endswith(RUNNING[how])
    assert said.count("own_of_mine.py") > 1


@pytest.mark.parametrize("how", REFUSED)
def test_what_fails_when_it_is_made_is_told_with_its_line(how: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(how) == 2
    assert capsys.readouterr().err == REFUSED[how]
    assert main(["validate", "m.yaml", "--types", "own_of_mine.py", "--set", f"how={how}", "--debug"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("Traceback (most recent call last):\n")
    assert said.endswith(REFUSED[how])


def test_a_clock_that_is_wrong_before_the_run(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("clock") == 1
    _, first, *rest = capsys.readouterr().err.splitlines(keepends=True)
    assert first.startswith("error: aspect watch failed in error() at clock at (0 s, 1): AttributeError: ")
    assert "".join(rest) == raised("return random.nothing", "random.nothing") + "   declared at m.yaml:10:3\n"


def test_a_figure_that_fails_costs_nothing_else(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("draw") == 1
    printed = capsys.readouterr()
    told = "error: figure picture cannot be drawn: KeyError: 'nothing'\n" + raised('results.signals["nothing"]')
    assert printed.err == told
    assert printed.out.splitlines()[-3:] == [
        "wrote out/whole.png",
        "wrote out/signals.parquet",
        "wrote out/manifest.json",
    ]
    assert sorted(each.name for each in Path("out").iterdir()) == ["manifest.json", "signals.parquet", "whole.png"]


def test_a_study_tells_the_line_and_repeats_the_run_for_its_traceback(capsys: pytest.CaptureFixture[str]) -> None:
    study = "study: s\nmodel: ./m.yaml\nvary: {how: [fire]}\nmetrics: {number: events}\n"
    Path("s.yaml").write_text(study, encoding="utf-8")
    command = ["study", "s.yaml", "--types", "own_of_mine.py", "--out", "out", "--jobs", "1", "--debug"]
    assert main(command) == 1
    said = capsys.readouterr().err
    told = RUNNING["fire"].removeprefix("error: ").replace("m.yaml", f"{os.getcwd()}/m.yaml")
    assert said.startswith(f"failed: {told}   to repeat it: epicycle run out/")
    assert "Traceback (most recent call last):\n" in said
    assert said.endswith("ZeroDivisionError: division by zero\nerror: 1 run failed\n")


def test_load_model_checks_figures_as_the_command_line_does(capsys: pytest.CaptureFixture[str]) -> None:
    Path("m.yaml").write_text(
        """\
model: m
actors:
  clock: {type: Clock, period: 1}
run: {stop: 3, record: [clock.output]}
figures:
  whole: {type: TimeSeriez, signals: [clock.output]}
  other: {type: Histogram, signals: [clock.output], bin: 3}
  last: {type: Histogram, signals: [clock.out]}
""",
        encoding="utf-8",
    )
    expected = """\
m.yaml:6:17: error: figure whole: there is no figure type 'TimeSeriez', did you mean 'TimeSeries'?
    6 |   whole: {type: TimeSeriez, signals: [clock.output]}
      |                 ^^^^^^^^^^
   help: valid types: Histogram, TimeSeries, Trajectories

m.yaml:7:53: error: figure other: Histogram has no parameter 'bin', did you mean 'bins'?
    7 |   other: {type: Histogram, signals: [clock.output], bin: 3}
      |                                                     ^^^
   help: valid parameters: signals, bins, label, log_x, log_y

m.yaml:8:37: error: figure last: 'clock.out' is not recorded, did you mean 'clock.output'?
    8 |   last: {type: Histogram, signals: [clock.out]}
      |                                     ^^^^^^^^^
   help: add it to 'record' in the run section
3 errors in m.yaml"""
    with pytest.raises(ModelError) as caught:
        load_model("m.yaml")
    assert str(caught.value) == expected
    assert main(["validate", "m.yaml"]) == 2
    assert capsys.readouterr().err == f"{expected}\n"


LABELS = ["$\\left", "$\\frac{a}{", "$x^" + "{" * 300, "a $b$ c", "\x1b[31m \u202e", "_hidden", "100 %", "\\n"]


@pytest.mark.slow
@pytest.mark.parametrize("label", LABELS)
def test_labels_are_text_and_no_formulas(label: str, monkeypatch: pytest.MonkeyPatch) -> None:
    import json

    figures = f"figures: {{f: {{type: TimeSeries, signals: [clock.output], label: {json.dumps(label)}}}}}\n"
    clock = "actors: {clock: {type: Clock, period: 1}}\nrun: {stop: 3, record: [clock.output]}\n"
    Path("m.yaml").write_text(f"model: m\n{clock}{figures}", encoding="utf-8")
    assert main(["run", "m.yaml", "--out", "out"]) == 0
    assert Path("out/f.png").stat().st_size > 10_000


@pytest.mark.slow
def test_a_backend_that_there_is_not() -> None:
    clock = "model: m\nactors: {clock: {type: Clock, period: 1}}\nrun: {stop: 3, record: [clock.output]}\n"
    Path("m.yaml").write_text(
        f"{clock}figures: {{f: {{type: TimeSeries, signals: [clock.output]}}}}\n", encoding="utf-8"
    )
    environment = {**os.environ, "MPLBACKEND": "nonsense"}
    program = "from epicycle.runner.interface.cli import main; main(['graph', 'm.yaml', '-o', 'g.svg'])"
    program += "; main(['run', 'm.yaml', '--out', 'out'])"
    words = [sys.executable, "-c", program]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert Path("g.svg").is_file()
    assert Path("out/f.png").is_file()
