"""Signals as lanes: what is left of one that has more samples than a screen has pixels."""

from __future__ import annotations

import numpy as np
import pytest

from epicycle.runner import load_model
from epicycle.runner.execution.engine import Simulation
from epicycle.runner.model.build.figures import figures_of
from epicycle.runner.model.text.problems import Problems
from epicycle.runner.show.view.lanes import POINTS, lanes, turning_points


def test_what_is_left_of_a_line_keeps_its_extremes() -> None:
    random = np.random.default_rng(5)
    times = np.sort(random.uniform(0.0, 100.0, 50_000))
    values = np.cumsum(random.normal(size=50_000))
    values[[31_000, 42_000]] = 1e6, -1e6
    kept = turning_points(times, values, 500)
    assert len(kept) <= 4 * 500
    assert (np.diff(kept) > 0).all()
    assert {0, 31_000, 42_000, 49_999} <= set(kept.tolist())
    part = np.minimum((times - times[0]) / (times[-1] - times[0]) * 500, 499).astype(int)
    for number in (0, 100, 499):
        inside = np.flatnonzero(part == number)
        chosen = np.intersect1d(kept, inside)
        assert values[chosen].max() == values[inside].max()
        assert values[chosen].min() == values[inside].min()


def test_what_is_no_number_hides_no_extreme() -> None:
    values = np.array([5.0, 9.0, np.inf, 6.0, np.nan, 5.5, 3.0, 4.0])
    assert turning_points(np.zeros(8), values, 2).tolist() == [0, 1, 2, 6, 7]


@pytest.mark.parametrize("values", [[np.nan] * 4, [1.0] * 4, [np.inf, -np.inf, 0.0, np.nan]])
def test_lines_that_are_none(values: list[float]) -> None:
    assert turning_points(np.zeros(4), np.array(values), 2)[[0, -1]].tolist() == [0, 3]


def test_lanes_of_figures_come_first_and_long_ones_are_thinned() -> None:
    model = load_model("mm1")
    results = Simulation(model).run(until=20_000.0)
    found, left_out = lanes(results, figures_of(model, Problems()).values())
    assert left_out == 0
    size, wait = (next(lane for lane in found if lane.name == name) for name in ("server.size", "wait.output"))
    assert found[0] is size
    assert size.asked
    assert not wait.asked
    assert len(size.times) <= POINTS < len(results["server.size"])
    assert size.left_out == len(results["server.size"]) - len(size.times)
    assert max(size.values) == max(results["server.size"].tokens)


def test_states_are_strips_of_changes() -> None:
    model = load_model("traffic_light")
    results = Simulation(model).run(until=600.0)
    lane = next(each for each in lanes(results, ())[0] if each.name == "cars.mode")
    assert lane.states is not None
    assert len(set(lane.states)) == len(lane.states) > 1
    assert [lane.states[int(value)] for value in lane.values[:3]] == results[lane.name].tokens[:3]
    assert (np.diff(lane.values) != 0).all()
