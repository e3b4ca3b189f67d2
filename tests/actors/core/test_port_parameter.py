"""Parameters that a port may change, and the kinds of values that parameters take."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import pytest

from epicycle.actors import Actor, OutputPort, Parameter, ParameterError, PortParameter
from epicycle.runner.execution.engine import ActorError, Simulation
from tests.engine.engine_parts import load, sends, simulate


class Level(Actor):
    """Tells its level whenever it fires."""

    is_source: ClassVar[bool] = True
    level = PortParameter(float, 1.0, unit="m", min=0, doc="how high")
    output = OutputPort(float)

    def initialize(self) -> None:
        for time in (0, 1.5, 3):
            self.wake_at(time)

    def fire(self) -> None:
        self.output.send(self.level)


MODEL = """
actors: {{clock: {{type: Ticker}}, scale: {{type: Scale, factor: {factor}}}, level: {{type: Level, level: 50 cm}}}}
connections:
  - clock.output -> scale.input
  - {{from: scale.output, to: level.level, delay: 1 s}}
"""


def test_the_latest_token_counts_and_a_new_run_begins_anew() -> None:
    model = load(MODEL.format(factor=2), types=[Level])
    for _ in range(2):
        results = Simulation(model, keep_log=True).run(until=3)
        assert sends(results, "level") == [
            (0.0, 1, "level.output", 0.5),
            (1.0, 1, "level.output", 0.0),
            (1.5, 1, "level.output", 0.0),
            (2.0, 1, "level.output", 2.0),
            (3.0, 1, "level.output", 4.0),
        ]


def test_a_wrong_token_is_the_error_of_the_actor_that_reads_it() -> None:
    with pytest.raises(ActorError) as caught:
        simulate(MODEL.format(factor=-1), until=5, types=[Level])
    assert caught.value.path == "level"
    assert caught.value.reason == "level.level: -1 is out of bounds, expected a number in m >= 0"


def test_it_is_set_by_tokens_alone() -> None:
    level = load(MODEL.format(factor=1), types=[Level]).graph.actors["level"]
    with pytest.raises(AttributeError, match=r"^level\.level can only be changed by a token at its port$"):
        level.level = 3.0  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("parameter", "given", "stored"),
    [
        (Parameter(int | float), 3, 3),
        (Parameter(int | float), 3.5, 3.5),
        (Parameter(int | float, unit="m"), "3 cm", 0.03),
        (Parameter(object), {"a": [1, None]}, {"a": [1, None]}),
        (Parameter(object, shape=(None,)), [1, "two", [3]], (1, "two", [3])),
        (Parameter(Path), "a/b.csv", Path("a/b.csv")),
    ],
)
def test_kinds_of_values(parameter: Parameter[Any], given: object, stored: object) -> None:
    value: Any = parameter.convert(given)
    assert (value, type(value)) == (stored, type(stored))


@pytest.mark.parametrize(
    ("parameter", "given", "message"),
    [
        (Parameter(int | float, min=0), "3", "'3' is not a number >= 0"),
        (Parameter(int | float), True, "true is not a number"),
        (Parameter(object, shape=(None,)), 3, "3 is not a list of values"),
        (Parameter(Path), "", "'' is not a file"),
        (Parameter(Path), 3, "3 is not a file"),
    ],
)
def test_wrong_values(parameter: Parameter[Any], given: object, message: str) -> None:
    with pytest.raises(ParameterError) as caught:
        parameter.convert(given)
    assert str(caught.value) == message
