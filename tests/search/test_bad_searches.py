"""What is said of a search that is wrong."""

from __future__ import annotations

import contextlib
import re
import tempfile
from io import StringIO
from pathlib import Path

import pytest

from epicycle.runner.interface.cli import main
from tests import cases
from tests.cases import Case
from tests.search.far import TEXT, falsify

BAD = Path(__file__).parent / "bad_searches.txt"
CASES = cases.read(BAD)
LISTS = re.compile(r"(packaged \w+: )[^;\n]*")  # which grow with the house


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "far.yaml").write_text(TEXT, encoding="utf-8")


def message(case: Case) -> str:
    """What is said about the options of a case."""
    options = {"--break": "away", "--runs": "1", "--out": "out"}
    words = [word for option in [*options.items(), *case.options] for word in option]
    said = StringIO()
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(said), contextlib.suppress(SystemExit):
        main(["search", "far.yaml", *words])
    return LISTS.sub(r"\1...", said.getvalue().rpartition("MODEL or STUDY\n")[2])


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_what_is_wrong_is_told(case: Case) -> None:
    assert message(case) == case.message
    assert not Path("out").exists()


def test_a_folder_of_something_else_is_left_alone(capsys: pytest.CaptureFixture[str]) -> None:
    falsify("--runs", 1, "--out", "out")
    capsys.readouterr()
    assert falsify("--runs", 1, "--vary", "x=0.0..1.0", "--out", "out") == 2
    assert capsys.readouterr().err == (
        "error: out was made when falsify_far had different factors: none, not x (float)\n"
        "   help: choose another folder with --out\n"
    )
    assert main(["search", "nosuch", "--break", "away"]) == 2
    assert capsys.readouterr().err.startswith("error: there is no packaged model 'nosuch'\n   help: packaged models: ")


def write_anew() -> None:
    """Put the present messages into the file; read the difference before keeping it."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        Path("far.yaml").write_text(TEXT, encoding="utf-8")
        cases.write(BAD, message)


if __name__ == "__main__":
    write_anew()
