"""Files that a model names: beside or below its own YAML file, or named by the user."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from epicycle.actors import Actor, Parameter
from epicycle.runner import Simulation
from epicycle.runner.model.build.load import load_model
from epicycle.runner.model.text.problems import ModelError


class Reader(Actor):
    """Names a file."""

    file = Parameter(Path, doc="what is read")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    inner = tmp_path / "inner"
    (inner / "data").mkdir(parents=True)
    (inner / "data" / "a.csv").write_text("1")
    (tmp_path / "secret.csv").write_text("2")
    os.mkfifo(inner / "pipe")
    (inner / "link.csv").symlink_to(tmp_path / "secret.csv")
    return inner


def load(folder: Path, file: str, *settings: str) -> Path:
    path = folder / "m.yaml"
    path.write_text(f"model: m\nactors:\n  reader: {{type: Reader, file: {file}}}\n")
    reader = load_model(path, set=settings, types=[Reader]).graph.actors["reader"]
    assert isinstance(reader, Reader)
    return reader.file


def test_a_file_below_the_model(folder: Path) -> None:
    assert load(folder, "data/a.csv").read_text() == "1"
    assert load(folder, "data/../data/a.csv").read_text() == "1"


def test_the_user_may_name_any_file(folder: Path) -> None:
    assert load(folder, "data/a.csv", f"reader.file={folder.parent / 'secret.csv'}").read_text() == "2"


OUTSIDE = "cannot be read: a file named in a model must be in or below the folder of its YAML file"


@pytest.mark.parametrize(
    ("file", "message"),
    [
        ("../secret.csv", f"'../secret.csv' {OUTSIDE}"),
        ("link.csv", f"'link.csv' {OUTSIDE}"),
        ("/etc/passwd", f"'/etc/passwd' {OUTSIDE}"),
        ("data", "'data' is a folder, not a file"),
        ("pipe", "'pipe' is a named pipe, not a regular file"),
        ("data/b.csv", "there is no file 'data/b.csv', did you mean 'data/a.csv'?"),
        ("a" * 300, f"{'a' * 300!r} cannot be read: File name too long"),
    ],
)
def test_what_cannot_be_read(folder: Path, file: str, message: str) -> None:
    with pytest.raises(ModelError) as caught:
        load(folder, file)
    [problem] = caught.value.problems
    assert problem.message == f"reader.file: {message}"
    assert problem.position is not None
    assert (problem.position.line, problem.position.column) == (3, 32)


def test_a_composite_may_have_the_name_of_an_actor_type(tmp_path: Path) -> None:
    """A later version of Epicycle may bring an actor of that name, and the model stays as it was."""
    path = tmp_path / "m.yaml"
    path.write_text(
        "model: m\ncomposites:\n  Merge: {outputs: [out], actors: {c: {type: Clock, period: 1}}, "
        "connections: [c.output -> out]}\nactors: {a: {type: Merge}}\nrun: {stop: 2, record: a.out}\n"
    )
    model = load_model(path)
    assert [str(each) for each in model.warnings] == [
        (
            f"{path}:3:3: warning: composite 'Merge' hides the actor type with the same name\n"
            "    3 |   Merge: {outputs: [out], actors: {c: {type: Clock, period: 1}}, connections: [c.output -> out]}\n"
            "      |   ^^^^^\n"
            "   help: rename it if you need both"
        )
    ]
    assert Simulation(model).run()["a.out"].tokens == [0, 1, 2]
