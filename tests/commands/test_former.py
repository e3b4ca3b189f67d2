"""What could be said before can be said now: each line of the table in CHANGELOG.md is run."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

import epicycle
from epicycle.runner.interface.cli import main
from epicycle.runner.interface.commands import COMMANDS, FORMER

ROOT = Path(__file__).parents[2]
LINES = re.findall(
    r"^\| `(epicycle[ .].+?)` \| `(epicycle[ .].+?)` \|$", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.M
)
MODEL = """
model: line
parameters: {factor: 2.0}
actors:
  clock: {type: Clock, period: 1 s}
  gain: {type: Scale, factor: "${factor}"}
  sink: {type: Recorder}
connections:
  - clock.output -> gain.input
  - gain.output -> sink.input
aspects: {loss: {type: PacketLoss, probability: 0.5, at: sink.input}}
run: {stop: 6 s}
monitors: {low: always gain.output < 20}
metrics: {number: {of: gain.output, take: count}}
"""


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder with all that the lines name."""
    monkeypatch.chdir(tmp_path)
    Path("line.yaml").write_text(MODEL, encoding="utf-8")
    rows = "".join(f"{time},{1.5 * time}\n" for time in range(1, 6))
    Path("measured.csv").write_text(f"time,value\n{rows}", encoding="utf-8")
    rows = "".join(f"{time},{int(time % 7 == 0)},{0.01 + time % 5 / 100}\n" for time in range(100))
    Path("link.csv").write_text(f"time,lost,rtt\n{rows}", encoding="utf-8")
    Path("log.csv").write_text("time,topic,value\n0.0,/robot/peer_plan,1\n1.0,/robot/peer_plan,2\n", encoding="utf-8")


def run_of_a_study() -> str:
    Path("lines.yaml").write_text("study: lines\nmodel: ./line.yaml\nreplications: 1\nmetrics: [number]\n")
    results = epicycle.study("lines.yaml", jobs=1, show_progress=False)
    run: str = results.table()["run"][0].as_py()
    return run[:12]


@pytest.mark.parametrize(
    ("before", "now"),
    [
        pytest.param(*line, id=line[0], marks=[pytest.mark.slow] * (place % 3 > 0))  # each takes a second or two
        for place, line in enumerate(LINES)
    ],
)
def test_each_line(before: str, now: str, capsys: pytest.CaptureFixture[str]) -> None:
    if before.startswith("epicycle."):
        name = before.removeprefix("epicycle.").partition("(")[0]
        assert not hasattr(epicycle, name)
        assert eval(now, {"epicycle": epicycle}).sentence
        return
    if "results/lines" in now:
        now = now.replace("RUN", run_of_a_study())
    assert main(shlex.split(now)[1:]) in (0, 3), capsys.readouterr().err
    capsys.readouterr()
    with pytest.raises(SystemExit) as ended:
        main(shlex.split(before)[1:])
    assert ended.value.code == 2
    word = before.split()[1]
    told = f"epicycle: error: command {word!r} is gone: it is now 'epicycle {FORMER[word]}'\n"
    assert capsys.readouterr().err.endswith(told)


def test_each_former_word_is_in_the_table() -> None:
    assert {before.split()[1] for before, _ in LINES if before.startswith("epicycle ")} == {*FORMER}
    assert not {each.name for each in COMMANDS} & {*FORMER}
