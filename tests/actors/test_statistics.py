"""Tables, statistics, sums and integrals."""

from __future__ import annotations

import math
import statistics
import sys

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from epicycle.runner.execution.engine import ActorError, Simulation
from epicycle.runner.model.text.problems import ModelError
from tests.actors.feeding import feed, load, model_of, seconds, tokens
from tests.actors.library_parts import problem


@settings(max_examples=30, deadline=None)
@given(
    st.lists(st.tuples(st.integers(-30, 30), st.floats(-5, 5)), min_size=1, max_size=6, unique_by=lambda pair: pair[0]),
    st.lists(st.floats(-40, 40), min_size=1, max_size=8),
)
def test_lookup_interpolates_like_numpy(table: list[tuple[int, float]], arguments: list[float]) -> None:
    table.sort()
    at, values = [float(x) for x, _ in table], [y for _, y in table]
    actor = {"type": "LookupTable", "values": values, "at": at, "outside": "nearest"}
    _, sent, _ = feed(actor, {"input": seconds(*arguments)})
    assert tokens(sent) == pytest.approx(list(np.interp(arguments, at, values)), abs=1e-12)


def test_lookup_by_index_and_beyond_the_ends() -> None:
    table = {"type": "LookupTable", "values": ["a", "b", "c"]}
    _, sent, _ = feed({**table, "outside": "nothing"}, {"input": seconds(2, 0, 3, -1, 1)})
    assert tokens(sent) == ["c", "a", "b"]
    with pytest.raises(ActorError, match="3 is outside the table, which goes from 0 to 2"):
        feed(table, {"input": seconds(3)})
    with pytest.raises(ActorError, match=r"0.5 is not an index"):
        feed(table, {"input": seconds(0.5)})
    for wrong, message in [
        ({"values": []}, "it: values: the table is empty; give at least one value"),
        ({"values": [1, 2], "at": [1]}, "it: at: 1 argument for 2 values; give one for each"),
        ({"values": [1, 2], "at": [1, 1]}, "it: at: [1.0, 1.0] is not ascending"),
        (
            {"values": ["a"], "at": [1]},
            "it: values: they must be numbers to be interpolated; leave out 'at' to look them up by index",
        ),
    ]:
        with pytest.raises(ModelError) as caught:
            model_of({"type": "LookupTable", **wrong}, {"input": seconds(0)})
        assert [problem.message for problem in caught.value.problems] == [message]


FLOATS = st.floats(allow_nan=False, allow_infinity=False, width=64)


@settings(max_examples=60, deadline=None)
@given(st.lists(FLOATS, min_size=1, max_size=30), st.integers(1, 8))
@example([1.7976931348623155e308, -7.44628877444977e307], 2)
@example([1.7976931348623151e308, -7.44628877444977e307], 2)
def test_moving_statistics_are_those_of_the_statistics_module(values: list[float], size: int) -> None:
    """The sums are exact, whatever has passed through the window; the module's are, too."""
    _, sent, _ = feed({"type": "MovingStatistics", "size": size}, {"input": seconds(*values)})
    windows = [values[max(0, k + 1 - size) : k + 1] for k in range(len(values))]
    assert tokens(sent, "mean") == [statistics.mean(window) for window in windows]
    assert tokens(sent, "min") == [min(window) for window in windows]
    assert tokens(sent, "max") == [max(window) for window in windows]
    assert tokens(sent, "number") == [len(window) for window in windows]
    deviations = [math.sqrt(2) * abs(w[0] / 2 - w[1] / 2) if len(w) == 2 else None for w in windows if len(w) > 1]
    for found, two in zip(tokens(sent, "std"), deviations, strict=True):
        if two is not None:  # where it is next to the largest float, one of them may be infinite and the other not
            largest = sys.float_info.max
            assert min(found, largest) == pytest.approx(min(two, largest), rel=1e-12, abs=1e-320)
    _, sent, _ = feed({"type": "MovingAverage", "size": size}, {"input": seconds(*values)})
    assert tokens(sent) == [statistics.mean(window) for window in windows]


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=20), st.integers(2, 8))
def test_moving_deviation(values: list[float], size: int) -> None:
    # An offset that is large beside the spread ruins a running sum of squares in floats.
    values = [1e9 + value for value in values]
    _, sent, _ = feed({"type": "MovingStatistics", "size": size}, {"input": seconds(*values)})
    windows = [values[max(0, k + 1 - size) : k + 1] for k in range(1, len(values))]
    assert tokens(sent, "std") == [pytest.approx(statistics.stdev(window), rel=1e-14) for window in windows]


def load_and_run_nan() -> None:
    """A nan cannot be written in JSON, in YAML it can."""
    model = load(
        "model: m\n"
        "actors:\n"
        "  source: {type: SingleEvent, value: .nan}\n"
        "  it: {type: MovingAverage, size: 2}\n"
        "connections: [source.output -> it.input]\n"
    )
    Simulation(model).run()


def test_statistics_over_a_time_window() -> None:
    events = [(0.0, 1.0), (1.0, 2.0), (2.5, 4.0), (2.6, 8.0), (10.0, 16.0)]
    _, sent, _ = feed({"type": "MovingAverage", "span": "1.5 s"}, {"input": events})
    assert tokens(sent) == [1.0, 1.5, 3.0, 6.0, 16.0]
    _, sent, _ = feed({"type": "MovingAverage", "span": "1.5 s", "size": 1}, {"input": events})
    assert tokens(sent) == [1.0, 2.0, 4.0, 8.0, 16.0]
    with pytest.raises(ModelError, match="give a window: 'size', a number of tokens, or 'span', a time, or both"):
        model_of({"type": "MovingAverage"}, {"input": events})
    with pytest.raises(ActorError, match="nan is not a finite number, and cannot be part of a statistic"):
        load_and_run_nan()


# -- accumulation ---------------------------------------------------------------------------------------------------

SIGNAL = st.lists(st.tuples(st.integers(0, 3000), st.floats(-9, 9)), min_size=1, max_size=12, unique_by=lambda e: e[0])


@settings(max_examples=30, deadline=None)
@given(SIGNAL)
def test_integrals_are_those_of_numpy(signal: list[tuple[int, float]]) -> None:
    signal.sort()
    times, values = np.array([t / 1000 for t, _ in signal]), np.array([x for _, x in signal])
    events = list(zip(times.tolist(), values.tolist(), strict=True))
    for method, areas in (
        ("hold", np.diff(times) * values[:-1]),
        ("trapezoid", np.diff(times) * (values[:-1] + values[1:]) / 2),
    ):
        actor = {"type": "Integrator", "method": method, "initial": 1.0}
        _, sent, _ = feed(actor, {"input": events, "trigger": [(5.0, 0)]})
        expected = [1.0, *(1.0 + np.cumsum(areas))]
        assert tokens(sent) == pytest.approx([*expected, expected[-1] + (5.0 - times[-1]) * values[-1]], abs=1e-9)


def test_limits_of_a_sum_that_exclude_each_other() -> None:
    message = "it: low is 2 and high is 1: low must not be above high"
    assert problem("{type: Accumulator, low: 2, high: 1}", [("input", [])]) == message


def test_sums_counts_and_differences() -> None:
    _, sent, _ = feed(
        {"type": "Accumulator", "initial": 10},
        {"input": [seconds(1, 2, 3, 4), seconds(1, 1)], "reset": [(3.0, 0), (9.0, 0)]},
    )
    assert sent["output"] == [(1.0, 12), (2.0, 15), (3.0, 13), (4.0, 17), (9.0, 10)]
    _, sent, _ = feed(
        {"type": "Counter", "initial": 5},
        {"increment": [seconds("a", "b"), [(1.0, "c")]], "decrement": [(2.0, 0), (2.0, 0)], "reset": [(3.0, 0)]},
    )
    assert sent["output"] == [(1.0, 7), (2.0, 6), (3.0, 5)]
    _, sent, _ = feed({"type": "Difference"}, {"input": seconds(3, 5, 4)})
    assert sent["output"] == [(2.0, 2), (3.0, -1)]
    _, sent, _ = feed({"type": "Difference", "initial": 1}, {"input": seconds(3, 5, 4)})
    assert tokens(sent) == [2, 2, -1]
