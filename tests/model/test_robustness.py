"""Whatever stands in a file, load_model answers in bearable time with a Model or a ModelError."""

from __future__ import annotations

import copy
import pickle
import time
from pathlib import Path

import pytest

import epicycle.actors
from epicycle.actors import (
    ChannelError,
    EpicycleError,
    FaultError,
    FilterError,
    ParameterError,
    PortError,
    ReplayError,
    Tag,
    UnitError,
)
from epicycle.actors.expression import ExpressionError
from epicycle.runner.execution.engine import ActorError, LogError, LoopError
from epicycle.runner.execution.results.encoding import TokenError
from epicycle.runner.interface.cli import main
from epicycle.runner.model.build.load import load_model
from epicycle.runner.model.text.problems import ModelError, Position, Problem
from tests.model.model_parts import TYPES


def said(text: str, tmp_path: Path, **options: object) -> str:
    path = tmp_path / "m.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ModelError) as caught:
        load_model(path, types=TYPES, **options)  # type: ignore[arg-type]
    return str(caught.value).replace(str(path), "m.yaml")


BOMBS = {
    "aliases": "a: &a [x, x, x, x, x, x, x, x, x]\n"
    + "".join(f"{b}: &{b} [{', '.join([f'*{a}'] * 9)}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)),
    "nesting": "model: m\nparameters: {p: " + "[" * 10_000 + "]" * 10_000 + "}\n",
    "mappings": "model: m\nparameters: " + "{p: " * 10_000 + "1" + "}" * 10_000 + "\n",
    "list": "model: m\nparameters: {p: '${[[0] * 100000] * 100000}'}\n",
    "repetition": "model: m\nparameters: {p: \"${'x' * 10 ** 9}\"}\n",
    "comprehension": "model: m\nparameters: {p: '${[i * j for i in range(99999) for j in range(99999)]}'}\n",
    "count": "model: m\nactors: {a: {type: Ramp, count: '${len([0] * 99999) * 99999}'}}\n",
    "doubling": "model: m\ncomposites:\n"
    + "".join(f"  C{i}: {{actors: {{a: {{type: C{i + 1}, count: 2}}}}}}\n" for i in range(40))
    + "  C40: {}\nactors: {a: {type: C0}}\n",
    "too deep": "model: m\ncomposites:\n"
    + "".join(f"  C{i}: {{actors: {{a: {{type: C{i + 1}}}}}}}\n" for i in range(60))
    + "  C60: {}\nactors: {a: {type: C0}}\n",
    "wires": "model: m\ncomposites:\n  Fan: {inputs: [in], outputs: [out], connections: ["
    + ", ".join(["in -> out"] * 10)
    + "]}\nactors:\n  a: {type: Ramp}\n  s: {type: Sum}\n"
    + "".join(f"  f{i}: {{type: Fan}}\n" for i in range(9))
    + "connections:\n  - a.output -> f0.in\n  - f8.out -> s.input\n"
    + "".join(f"  - f{i}.out -> f{i + 1}.in\n" for i in range(8)),
    "passage": "model: m\ncomposites: {Through: {inputs: [in], outputs: [out], connections: [in -> out]}}\nactors:\n"
    + "".join(f"  f{i}: {{type: Through}}\n" for i in range(2000))
    + "connections:\n"
    + "".join(f"  - f{i}.out -> f{i + 1}.in\n" for i in range(1999)),
    "pattern": "model: m\nactors: {a: {type: Ramp}}\nrun: {record: '" + "**." * 300 + "x'}\n",
    "long name": "model: m\nactors: {a: {type: " + "R" * 100_000 + "}}\n",
    "far patterns": "model: m\ncomposites:\n"
    + "".join(f"  C{i}: {{actors: {{a: {{type: C{i + 1}}}}}}}\n" for i in range(45))
    + "  C45: {actors: {a: {type: Ramp}}}\nactors: {a: {type: C0}}\nrun: {record: ['"
    + "**." * 22
    + "x', '"
    + "**.a." * 20
    + "x']}\n",
    "values in all": "model: m\nactors:\n"
    + "".join(f"  a{i}: {{type: Ramp, init: '${{sum([i * {i} for i in range(9000)])}}'}}\n" for i in range(500)),
    "lists in all": f"model: m\nactors: {{a: {{type: Ramp, init: [{'1, ' * 9_999}1], count: 9999}}}}\n",
    "parameters": "model: m\nparameters:\n" + "".join(f"  a{i}: 1\n" for i in range(20_000)),
    "renamed": "model: m\nactors:\n"
    + "".join(f"  robot_{i}: {{type: Ramp}}\n" for i in range(2_000))
    + "connections:\n"
    + "".join(f"  - robt_{i}.output -> robo_{i}.input\n" for i in range(2_000)),
    "aspects": "model: m\nactors:\n  a: {type: Ramp, count: 5000}\n  s: {type: Sum, count: 5000}\n"
    "connections: ['a[*].output -> s[*].input']\naspects:\n"
    + "".join(f"  a{i}: {{type: PacketLoss, probability: 0, at: '**.input'}}\n" for i in range(500)),
    "many mistakes": "model: m\nactors:\n" + "".join(f"  a{i}: {{type: Rmap{i}}}\n" for i in range(3000)),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", BOMBS)
def test_bombs_do_no_harm(name: str, tmp_path: Path) -> None:
    started = time.process_time()
    assert "error: " in said(BOMBS[name], tmp_path)
    assert time.process_time() - started < 5


@pytest.mark.slow
def test_what_is_said_about_bombs(tmp_path: Path) -> None:
    assert "m.yaml:2:115: error: nested deeper than 100 levels" in said(BOMBS["nesting"], tmp_path)
    assert "a.a.a.a" in said(BOMBS["too deep"], tmp_path)
    assert "composites are nested deeper than 50 levels" in said(BOMBS["too deep"], tmp_path)
    assert "the model has more than 20,000 actors and composites" in said(BOMBS["doubling"], tmp_path)
    assert "the model has more than 200,000 wires" in said(BOMBS["wires"], tmp_path)
    assert "a path through more than 200 composite ports, from f0.in to f1999.out" in said(BOMBS["passage"], tmp_path)
    assert "more than 100 errors in m.yaml" in said(BOMBS["many mistakes"], tmp_path)


def test_files_that_are_no_text(tmp_path: Path) -> None:
    path = tmp_path / "m.yaml"
    path.write_bytes(b"model: \xff\n")
    with pytest.raises(ModelError, match="not UTF-8"):
        load_model(path)
    with pytest.raises(ModelError, match="is a folder"):
        load_model(f"{tmp_path}/")
    with pytest.raises(ModelError):
        load_model("x" * 5000 + ".yaml")
    with pytest.raises(ModelError):
        load_model("a\0b.yaml")
    with pytest.raises(ModelError, match="there is no packaged model ''"):
        load_model("")


def test_nothing_is_executed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    said("model: m\nactors: {a: !!python/object/apply:os.system ['touch harm']}\n", tmp_path)
    said("model: m\nparameters: {p: \"${__import__('os').system('touch harm')}\"}\n", tmp_path)
    said("model: m\n", tmp_path, set=["p=!!python/object/apply:os.system ['touch harm']"])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["m.yaml"]


POSITION = Position("m.yaml", 1, 2, 3, "model: m")
ERRORS = [
    ModelError([Problem("wrong", POSITION, ("help",)), Problem("worse")], 3),
    ActorError("main.sensor", Tag(5, 2), "fire()", "ValueError: no", "m.yaml:3:4"),
    LoopError(7, ("a", "b")),
    LoopError(7, ()),
    FaultError("no", ("a", 3), of_key=True, span=(1, 2), help=["yes"]),
    ParameterError("no"),
    UnitError("no"),
    PortError("no"),
    ReplayError("no"),
    ChannelError("no"),
    FilterError("no"),
    LogError("no"),
    TokenError("no"),
    ExpressionError("no", 3, 4),
    EpicycleError("no"),
]


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_errors_travel_between_processes(error: EpicycleError) -> None:
    for rebuilt in (pickle.loads(pickle.dumps(error)), copy.copy(error), copy.deepcopy(error)):
        assert type(rebuilt) is type(error)
        assert (str(rebuilt), rebuilt.args, vars(rebuilt)) == (str(error), error.args, vars(error))


def test_all_public_errors_are_tried() -> None:
    public = {value for name in epicycle.actors.__all__ if isinstance(value := getattr(epicycle.actors, name), type)}
    assert {each for each in public if issubclass(each, EpicycleError)} <= {type(error) for error in ERRORS}


def test_limits_are_raised_by_who_wants_a_larger_model(tmp_path: Path) -> None:
    path = tmp_path / "m.yaml"
    path.write_text(
        "model: m\n"
        "actors: {a: {type: Const, value: 1, count: 30}, b: {type: Recorder, count: 11}}\n"
        'connections: ["a[..9].output => b[*].input"]\n',
        encoding="utf-8",
    )
    with pytest.raises(ModelError) as refused:
        load_model(path, max_actors=40)
    assert f"{refused.value}" == (
        f"{path}:2:49: error: b: the model has more than 40 actors and composites\n"
        "    2 | actors: {a: {type: Const, value: 1, count: 30}, b: {type: Recorder, count: 11}}\n"
        "      |                                                 ^\n"
        "   help: if this is intended, raise the limit: --max-actors N, or load_model(..., max_actors=N)"
    )
    model = load_model(path, max_actors=41)
    assert (len(model.graph.actors), model.graph.connections) == (41, 110)
    assert main(["validate", str(path), "--max-actors", "41"]) == 0
    assert main(["validate", str(path), "--max-actors", "40"]) == 2


def test_a_part_that_another_parameter_takes(tmp_path: Path) -> None:
    told = said(
        "model: m\n"
        "actors:\n"
        "  b: {type: Server, service_time: {type: Exponential, mean: 1 s}}\n"
        "  c: {type: Server, service_time: {type: [1]}}\n",
        tmp_path,
    )
    assert told.startswith(
        "m.yaml:3:35: error: b.service_time: {'type': 'Exponential', 'mean': '1 s'} is not a number in s >= 0\n"
        "    3 |   b: {type: Server, service_time: {type: Exponential, mean: 1 s}}\n"
        "      |                                   ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^\n"
        "   help: Exponential is a value of 'distribution': distribution: {type: Exponential, ...}\n"
        "\n"
        "m.yaml:4:35: error: c.service_time: {'type': [1]} is not a number in s >= 0\n"
    )


def test_a_distribution_that_no_parameter_takes(tmp_path: Path) -> None:
    told = said(
        "model: m\n"
        "actors:\n"
        "  b: {type: TimeDelay, delay: {type: Exponential, mean: 1 s}}\n"
        "  c: {type: PoissonClock, mean_interval: {type: Uniform}}\n"
        "  d: {type: Scale, factor: {type: Exponentiel}}\n",
        tmp_path,
    )
    assert told == (
        "m.yaml:3:31: error: b.delay: {'type': 'Exponential', 'mean': '1 s'} is not a number in s >= 0\n"
        "    3 |   b: {type: TimeDelay, delay: {type: Exponential, mean: 1 s}}\n"
        "      |                               ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^\n"
        "   help: 'delay' is one number, or comes by the input b.delay: connect it to a {type: Random, distribution: "
        "{type: Exponential, ...}}, which draws for each of its triggers\n"
        "\n"
        "m.yaml:4:42: error: c.mean_interval: {'type': 'Uniform'} is not a number in s > 0\n"
        "    4 |   c: {type: PoissonClock, mean_interval: {type: Uniform}}\n"
        "      |                                          ^^^^^^^^^^^^^^^\n"
        "   help: 'mean_interval' is one number for the whole run; what varies is sent by a {type: Random, "
        "distribution: {type: Uniform, ...}}, which draws for each of its triggers\n"
        "\n"
        "m.yaml:5:28: error: d.factor: {'type': 'Exponentiel'} is not a number\n"
        "    5 |   d: {type: Scale, factor: {type: Exponentiel}}\n"
        "      |                            ^^^^^^^^^^^^^^^^^^^\n"
        "3 errors in m.yaml"
    )
