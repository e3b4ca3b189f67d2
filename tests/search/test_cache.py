"""What is kept of a search answers for the same model only, and only as it was written."""

from __future__ import annotations

import json
import logging
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import epicycle
from epicycle.runner.model.build.load import load_model
from epicycle.runner.model.build.model import Model
from epicycle.runner.search.cache import EvaluationCache

PLAIN = """
model: m
include: [part.yaml]
actors: {p: {type: Part}}
run: {stop: 1}
"""
PART = "composites: {Part: {parameters: {x: 1}, actors: {c: {type: Steps, period: '${x}'}}}}"
TYPES = """
from epicycle.actors import Actor, Parameter, OutputPort
from {neighbour} import LIMIT

class Steps(Actor):
    is_source = True
    output = OutputPort(float)
    period = Parameter(float, 1.0)

    def fire(self):
        self.output.send(LIMIT)
"""
SHAPE = [(float,), (int, type(None))]


def model_in(folder: Path, name: str, **changes: Any) -> Model:
    """A model whose types import a neighbour; names of modules are new, as Python keeps those that it knows."""
    from epicycle.runner.model.catalogue.types import types_of_file

    folder.mkdir(exist_ok=True)
    (folder / "m.yaml").write_text(PLAIN)
    (folder / "part.yaml").write_text(PART)
    (folder / f"types_{name}.py").write_text(TYPES.format(neighbour=f"neighbour_{name}"))
    (folder / f"neighbour_{name}.py").write_text("LIMIT = 1.0\n")
    return load_model(folder / "m.yaml", types=types_of_file(folder / f"types_{name}.py"), **changes)


def known(folder: Path, model: Model, about: dict[str, Any] | None = None) -> bool:
    """Whether the outcome of a try is known already."""
    asked = []
    EvaluationCache(model, about or {}, SHAPE, folder).outcome("a", lambda: asked.append(1) or [1.5, None])
    return not asked


def test_the_same_model_is_known(tmp_path: Path) -> None:
    model = model_in(tmp_path / "one", "a")
    assert not known(tmp_path / "out", model)
    assert known(tmp_path / "out", model)
    assert known(tmp_path / "out", model_in(tmp_path / "one", "a"))
    assert not known(tmp_path / "out", model, {"seed": 2})


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("b", lambda folder: (folder / "m.yaml").write_text(PLAIN.replace("stop: 1", "stop: 2"))),
        ("c", lambda folder: (folder / "part.yaml").write_text(PART.replace("x: 1", "x: 2"))),
        ("d", lambda folder: (folder / "types_d.py").write_text(f"{TYPES.format(neighbour='neighbour_d')}\n\n")),
        ("e", lambda folder: (folder / "neighbour_e.py").write_text("LIMIT = 2.0\n")),
    ],
)
def test_a_changed_file_makes_another_model(tmp_path: Path, name: str, change: Callable[[Path], Any]) -> None:
    folder = tmp_path / "one"
    model = model_in(folder, name)
    assert not known(tmp_path / "out", model)
    change(folder)
    types = model.origin.types if model.origin else ()
    assert not known(tmp_path / "out", load_model(folder / "m.yaml", types=types))


def test_settings_and_aspects_make_another_model(tmp_path: Path) -> None:
    folder = tmp_path / "one"
    assert not known(tmp_path / "out", model_in(folder, "f"))
    assert not known(tmp_path / "out", model_in(folder, "f", set=["p.x=2"]))
    assert not known(tmp_path / "out", model_in(folder, "f", set=["p.x=3"]))
    disturbance = folder / "loss.yaml"
    for probability in (0.1, 0.2):
        loss = f"{{type: Bias, by: {probability}, at: p.c.output}}"
        disturbance.write_text(f"disturbance: loss\naspects: {{loss: {loss}}}\n")
        disturbed = model_in(folder, "f", disturb=disturbance)
        assert not known(tmp_path / "out", disturbed)
        assert known(tmp_path / "out", disturbed)
    assert not known(tmp_path / "out", model_in(folder, "f", disturb=disturbance, without_aspects=["loss"]))


def test_of_a_model_that_a_program_made_nothing_is_known(tmp_path: Path) -> None:
    model = epicycle.Model("m", stop=1)
    assert not known(tmp_path, model)
    assert not known(tmp_path, model)


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("g0", lambda line: line.replace("1.5", "1.6")),
        ("g1", lambda line: "[[1], 2]"),
        ("g2", lambda line: "[" * 100_000),
        ("g3", lambda line: line[:-3]),
        ("g4", lambda line: '["a", {"a": 1}, "0"]'),
        ("g5", lambda line: "\udcff"),
    ],
)
def test_a_damaged_line_is_reported_and_made_again(
    tmp_path: Path, name: str, change: Callable[[str], str], caplog: pytest.LogCaptureFixture
) -> None:
    model = model_in(tmp_path / "one", name)
    tried = EvaluationCache(model, {}, SHAPE, tmp_path)
    for key in "abc":
        tried.outcome(key, lambda: [1.5, None])
    (file,) = tmp_path.glob("tried-*.jsonl")
    whole = file.read_bytes()
    head, *lines = whole.decode().split("\n")
    lines[1] = change(lines[1])
    file.write_bytes("\n".join([head, *lines]).encode(errors="surrogateescape"))
    with caplog.at_level(logging.WARNING):
        tried = EvaluationCache(model, {}, SHAPE, tmp_path)
    assert caplog.messages == [f"{file} has 1 damaged line: what they told is tried again"]
    assert [tried.outcome(key, lambda: [0.5, 1]) for key in "abc"] == [[1.5, None], [0.5, 1], [1.5, None]]


def test_an_outcome_of_another_shape_is_not_taken(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Whoever sends a file can compute its checks."""
    model = model_in(tmp_path / "one", "h")
    EvaluationCache(model, {}, [(str,)], tmp_path).outcome("a", lambda: ["text", "text"])
    (file,) = tmp_path.glob("tried-*.jsonl")
    kept = file.read_text()
    shutil.copy(file, tmp_path / "copy")
    assert not known(tmp_path, model)
    assert [json.loads(line)[0] for line in kept.splitlines()[1:]] == ["a"]


def test_another_head_is_reported(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    model = model_in(tmp_path / "one", "i")
    assert not known(tmp_path, model)
    (file,) = tmp_path.glob("tried-*.jsonl")
    file.write_text("{}\n" + file.read_text().split("\n", 1)[1])
    assert not known(tmp_path, model)
    assert caplog.messages == [f"{file} is damaged: everything is tried again"]
