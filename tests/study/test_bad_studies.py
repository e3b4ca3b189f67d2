"""What is said about studies that are wrong: whole messages, from ``bad_studies.txt``.

A case is ``### its name``, ``$ option`` lines for --set, the study, ``>>>``, and the message.
``python -m tests.study.test_bad_studies`` writes the messages anew; read the difference before keeping it.
"""

from __future__ import annotations

import contextlib
import re
import tempfile
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from epicycle.runner import ModelError, load_model
from epicycle.runner.interface.cli import main
from epicycle.runner.model.catalogue.figure import own_figures
from epicycle.runner.model.catalogue.types import built_in
from epicycle.runner.model.language.schema import json_schema
from epicycle.runner.model.text.document import parse, plain
from epicycle.runner.model.text.problems import Problems
from epicycle.runner.show.report import check_figures, own_study_figures
from epicycle.runner.study.judge.study_results import open_study
from tests import cases
from tests.cases import Case
from tests.study.study_parts import STUDY, plan_of, write

FILE = Path(__file__).parent / "bad_studies.txt"
CASES = cases.read(FILE)
# What grows with the house.
LISTS = re.compile(r"(packaged \w+: |known functions: )[^;\n]*")


def message(case: Case) -> str:
    """What is said about a study beside the model of the tests."""
    write(Path("."), case.text)
    (Path("gusts.yaml")).write_text("disturbance: gusts\nset: {dirft: 1}\n", encoding="utf-8")
    try:
        check_figures(plan_of(Path("walks.yaml"), set=tuple(value for _, value in case.options)))
    except ModelError as error:
        return LISTS.sub(r"\1...", str(error)) + "\n"
    return "nothing\n"


@pytest.mark.parametrize("case", [pytest.param(case, id=case.name) for case in CASES])
def test_message(case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert message(case) == case.message


def test_the_advice_for_the_end_of_runs_can_be_followed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A study has no --until: a parameter does."""
    head = "model: m\nactors: {c: {type: Clock, period: 1 s}}\nmetrics: {ticks: {of: c.output, take: count}}\n"
    (tmp_path / "m.yaml").write_text(head + "run: {stop: 5 s}\n", encoding="utf-8")
    (tmp_path / "s.yaml").write_text("study: s\nmodel: ./m.yaml\nmetrics: [ticks]\n", encoding="utf-8")
    run = ["study", str(tmp_path / "s.yaml"), "--out", str(tmp_path / "out"), "--jobs", "1"]
    assert main([*run, "--set", "stop=2"]) == 2
    assert capsys.readouterr().err == (
        "command line:1:7: error: 'stop' matches no parameter\n"
        "    1 | --set stop=2\n"
        "      |       ^^^^^^\n"
        "   help: set the end of a single run with --until, or give the model a parameter for it: 'stop: ${end}'\n"
    )
    text = head + 'parameters: {end: {value: 5 s, unit: s}}\nrun: {stop: "${end}"}\n'
    (tmp_path / "m.yaml").write_text(text, encoding="utf-8")
    assert main([*run, "--set", "end=2"]) == 0
    assert open_study(tmp_path / "out").table()["ticks"].to_pylist() == [3]


def test_names_of_the_other_kind(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write(tmp_path)
    with pytest.raises(ModelError) as caught:
        load_model(path)
    assert str(caught.value) == f"error: {path} is a study, not a model\n   help: run it: epicycle study {path}"
    assert main(["study", "tabel_1"]) == 2
    assert LISTS.sub(r"\1...", capsys.readouterr().err) == (
        "error: there is no packaged study 'tabel_1', did you mean 'table_1'?\n"
        "   help: packaged studies: ...; a path to a file ends in .yaml\n"
    )
    assert main(["validate", "table_1", "--without", "packet_loss"]) == 2
    assert capsys.readouterr().err == "error: --without is for models: a study states in its file what it changes\n"


def test_packaged_studies_are_valid(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", "table_1"]) == 0
    assert capsys.readouterr().out == "table_1 is valid: 60 conditions of 100 replications, 6,000 runs\n"
    assert main(["validate", "readings"]) == 0
    assert capsys.readouterr().out == "readings is valid: 1,680 conditions of 10 replications, 16,800 runs\n"
    assert main(["validate", "waiting_time"]) == 0
    assert capsys.readouterr().out == "waiting_time is valid: 5 conditions of 10 replications, 50 runs\n"


# Those cases whose shape is broken, as far as a schema sees one file and no values of other kinds.
SHAPES = (
    "not a mapping",
    "unknown keys",
    "no such model",
    "values",
    "dimensions",
    "no mapping",
    "ranges",
    "hypercubes",
    "until",
    "numbers of until",
    "metrics in a list",
    "cases",
    "claims",
    "guidelines",
    "choosing nothing that is varied",
    "claims in a list",
)


def test_schema_refuses_what_is_misshapen() -> None:
    def document(text: str) -> object:
        node = parse(text, "s.yaml", Problems())
        assert node is not None
        return plain(node)

    validator = Draft202012Validator(json_schema(built_in(), own_figures(), own_study_figures()))
    refused = [case.name for case in CASES if not validator.is_valid(document(case.text))]
    assert [name for name in SHAPES if name not in refused] == []
    said = {case.name: case.message for case in CASES}
    assert [name for name in refused if said[name] == "nothing\n"] == []
    for good in (STUDY, "study: s\nmodel: mm1\nset:\nvary:\nmetrics:\n"):
        assert list(validator.iter_errors(document(good))) == []


def write_anew() -> None:
    """Put the present messages into the file."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        cases.write(FILE, message)


if __name__ == "__main__":
    write_anew()
