"""Bounds of declared parameters: in the parameter's unit, or with a unit of their own."""

from __future__ import annotations

import json
from pathlib import Path

import jsonschema
import pytest
import yaml

from epicycle.runner.model.build.load import load_model
from epicycle.runner.model.text.problems import ModelError

ROOT = Path(__file__).parents[2]
TEXT = """
model: m
composites:
  Base:
    parameters: {{wait: {{value: 5 ms, unit: ms, min: 1 ms, max: 2 s}}}}
    actors: {{c: {{type: Clock, period: "${{wait}}"}}}}
  Sub: {{extends: Base, parameters: {{wait: {{{inner}}}}}}}
parameters: {{far: {{value: 1 km, unit: km, {bounds}}}}}
actors: {{s: {{type: Sub, wait: {wait}}}, g: {{type: Constant, value: "${{far}}"}}}}
run: {{stop: 1 s}}
""".replace("Constant", "Const")


def load(folder: Path, *, inner: str = "max: 6000 us", bounds: str = "max: 2 km", wait: str = "2 ms") -> None:
    file = folder / "m.yaml"
    file.write_text(TEXT.format(inner=inner, bounds=bounds, wait=wait))
    load_model(file)


def test_the_schema_marks_no_valid_file() -> None:
    schema = jsonschema.Draft202012Validator(json.loads((ROOT / "models/schema.json").read_text()))
    text = TEXT.format(inner="max: 6000 us", bounds="min: 10 m, max: 2 km", wait="2 ms")
    assert [error.message for error in schema.iter_errors(yaml.safe_load(text))] == []


@pytest.mark.parametrize("bounds", ["max: 2 km", "max: 2", "min: 10 m, max: 2000 m", "min: -1", "max: 1 km"])
def test_what_is_within(bounds: str, tmp_path: Path) -> None:
    load(tmp_path, bounds=bounds)


@pytest.mark.parametrize("wait", ["1 ms", "1000 us", "6 ms", "0.006 s", "3"])
def test_bounds_that_are_inherited(wait: str, tmp_path: Path) -> None:
    load(tmp_path, wait=wait)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"bounds": "max: 500 m"}, "far: 1 is out of bounds, expected a number in km <= 0.5"),
        ({"bounds": "min: 2 km"}, "far: 1 is out of bounds, expected a number in km >= 2"),
        ({"bounds": "min: 2 km, max: 1500 m"}, "parameter 'far': min is greater than max"),
        ({"bounds": "above: 2 km, max: 2000 m"}, "parameter 'far': above is not less than max"),
        ({"bounds": "min: 2 s"}, "parameter 'far': '2 s' is a time, expected a length in km"),
        ({"bounds": "min: 2 foo"}, "min of parameter 'far': '2 foo' has the unknown unit 'foo'"),
        ({"wait": "7 ms"}, "s.wait: 7 is out of bounds, expected a number in ms from 1 to 6"),
        ({"wait": "0.5 ms"}, "s.wait: 0.5 is out of bounds, expected a number in ms from 1 to 6"),
        ({"inner": "max: 1 us"}, "Sub: parameter 'wait': min is greater than max"),
        ({"inner": "max: 3 m"}, "Sub: parameter 'wait': '3 m' is a length, expected a time in ms"),
    ],
)
def test_what_is_not(changes: dict[str, str], message: str, tmp_path: Path) -> None:
    with pytest.raises(ModelError) as raised:
        load(tmp_path, **changes)
    (problem,) = raised.value.problems
    assert problem.message == message
    assert problem.position is not None


def test_choices_are_texts(tmp_path: Path) -> None:
    file = tmp_path / "m.yaml"
    file.write_text('model: m\nparameters: {n: {value: 2, choices: [1, 2]}}\nrun: {stop: "${n} s"}\n')
    with pytest.raises(ModelError) as raised:
        load_model(file)
    (problem,) = raised.value.problems
    assert (problem.message, problem.help) == (
        "n: 2 is not one of 1, 2",
        ("the choices are texts: write '2' in quotes",),
    )
