"""PID: against closed forms, difference equations and, in loops, theory."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import scipy.signal

from epicycle.actors import PID, ParameterError
from epicycle.actors.testing import Harness
from epicycle.runner import Simulation
from tests.actors.feeding import load

Events = list[tuple[float, Any]]


def control(until: float = 1e6, inputs: dict[str, Events] | None = None, **parameters: Any) -> Harness:
    harness = Harness(PID("it", **parameters))
    harness.run(until, **(inputs or {}))
    return harness


def samples(count: int, seed: int = 0, irregular: bool = True) -> Events:
    random = np.random.default_rng(seed)
    steps = random.uniform(0.05, 0.5, size=count) if irregular else np.full(count, 0.25)
    times = np.round(np.cumsum(steps), 9).tolist()
    return list(zip(times, random.normal(size=count).tolist(), strict=True))


@pytest.mark.parametrize("irregular", [False, True])
def test_each_part_is_what_the_signal_makes_of_it(irregular: bool) -> None:
    """P of the error, I of the held error, D of the signal that runs straight from sample to sample, behind a lag."""
    measured = samples(60, irregular=irregular)
    gains = {"proportional": 2.0, "integral": 0.7, "derivative": 0.3, "filter_time": 0.2, "setpoint": 0.5}
    weights = {"setpoint_weight": 0.6, "derivative_weight": 0.4}
    found = control(inputs={"measurement": measured}, **gains, **weights)
    times, values = np.array([t for t, _ in measured]), np.array([y for _, y in measured])
    errors = 0.5 - values
    proportional = 2.0 * (0.6 * 0.5 - values)
    integral = 0.7 * np.concatenate([[0.0], np.cumsum(errors[:-1] * np.diff(times))])
    # The derivative of what runs straight from sample to sample, through 1 / (T s + 1), by SciPy.
    derivative, state = [0.0], 0.0
    for before, after, step in zip(values, values[1:], np.diff(times), strict=False):
        slope = -(after - before) / step
        _, out, _ = scipy.signal.lsim(
            ([[-1 / 0.2]], [[1 / 0.2]], [[1]], [[0]]), [slope, slope], [0, step], X0=[state], interp=False
        )
        state = float(np.ravel(out)[-1])
        derivative.append(0.3 * state)
    assert found.tokens("output") == pytest.approx((proportional + integral + np.array(derivative)).tolist(), abs=1e-11)
    assert found.tokens("error") == pytest.approx(errors.tolist(), abs=0)


def test_the_error_may_run_straight_from_sample_to_sample() -> None:
    """As in Ptolemy, where the input is the error: Kp e + Ki (sum of trapezoids) + Kd (difference quotient)."""
    measured = samples(40, seed=2)
    found = control(
        inputs={"measurement": measured},
        proportional=-2, integral=-0.5, derivative=-0.3, setpoint=0, integration="trapezoid",
    )  # fmt: skip
    times, errors = np.array([t for t, _ in measured]), np.array([x for _, x in measured])
    steps = np.diff(times)
    total = np.concatenate([[0.0], np.cumsum((errors[1:] + errors[:-1]) / 2 * steps)])
    slope = np.concatenate([[0.0], np.diff(errors) / steps])
    assert found.tokens("output") == pytest.approx((2 * errors + 0.5 * total + 0.3 * slope).tolist(), abs=1e-12)


def test_a_reset_sets_it_back_before_the_measurement() -> None:
    inputs = {"measurement": [(float(k), 0.0) for k in range(6)], "reset": [(2.5, 0), (4.0, 0)]}
    found = control(inputs=inputs, setpoint=1, proportional=0, integral=1, initial=10)
    assert found.tokens("output") == [10.0, 11.0, 12.0, 10.0, 10.0, 11.0]


def test_without_a_lag_the_derivative_is_the_slope() -> None:
    found = control(inputs={"measurement": [(0.0, 0.0), (0.5, 1.0), (2.0, -2.0)]}, proportional=0, derivative=3)
    assert found.tokens("output") == [0.0, -6.0, 6.0]


def test_measurements_of_one_tag_do_not_divide_by_no_time() -> None:
    measured = [(0.0, 0.0), (0.0, 5.0), (1.0, 1.0), (1.0, 2.0)]
    found = control(inputs={"measurement": measured}, proportional=0, derivative=1)
    assert found.tokens("output") == [0.0, 0.0, 4.0, 3.0]  # from the latest of an earlier time


def test_a_setpoint_counts_from_its_own_time_on() -> None:
    inputs = {"measurement": [(0.0, 0.0), (2.0, 0.0)], "setpoint": [(0.5, 4.0)]}
    found = control(inputs=inputs, proportional=0, integral=1)
    assert found.tokens("output") == [0.0, 1.5 * 4]


def test_the_feedforward_is_added_and_limits_hold() -> None:
    inputs = {"measurement": [(0.0, 1.0), (1.0, 1.0), (2.0, 1.0)], "feedforward": [(0.5, 10.0), (2.0, -99.0)]}
    found = control(inputs=inputs, proportional=2, low=-5, high=7)
    assert found.tokens("output") == [-2.0, 7.0, -5.0]


# -- windup -----------------------------------------------------------------------------------------------------------


def wound_up(**parameters: Any) -> list[float]:
    """The output while an error of 1 stands for 10 s, and then one of -1, at a limit of 2 and a sample each second."""
    measured = [(float(k), 0.0 if k <= 10 else 2.0) for k in range(31)]
    inputs = {"measurement": measured}
    return control(inputs=inputs, setpoint=1, proportional=1, integral=0.5, high=2, low=-2, **parameters).tokens(
        "output"
    )


def test_without_anti_windup_the_integral_must_come_back_first() -> None:
    wanted = []
    for k in range(31):
        total = 0.5 * min(k, 11) - 0.5 * max(k - 11, 0)
        wanted.append(min(max((1 if k <= 10 else -1) + total, -2.0), 2.0))
    assert wound_up(anti_windup="none") == wanted


def test_clamping_stops_at_the_limit_and_leaves_at_once() -> None:
    # At 3 s the output would be 2.5: from there on the integral stands at 1.5, until the error turns.
    assert wound_up() == [1.0, 1.5, *[2.0] * 9, 0.5, 0.0, -0.5, -1.0, -1.5, *[-2.0] * 15]


def test_back_calculation_leads_the_output_back_to_its_limit() -> None:
    lag, total, wanted = 0.8, 0.0, []
    error = excess = 0.0
    for k in range(31):
        if k:
            total += 0.5 * error - excess * (1 - math.exp(-1 / lag))
        error = 1.0 if k <= 10 else -1.0
        free = error + total
        wanted.append(min(max(free, -2.0), 2.0))
        excess = free - wanted[-1]
    assert wound_up(anti_windup="back_calculation", tracking_time=lag) == pytest.approx(wanted, abs=1e-14)
    # At rest at the limit, what the error adds in a sample is what tracking takes away.
    assert excess == pytest.approx(-0.5 / (1 - math.exp(-1 / lag)), rel=1e-4)


def test_tracking_times_follow_from_the_gains() -> None:
    for gains, lag in (({"derivative": 0.32}, 0.8), ({}, 2.0)):
        given = wound_up(anti_windup="back_calculation", tracking_time=lag, **gains)
        assert wound_up(anti_windup="back_calculation", **gains) == given


@pytest.mark.parametrize("method", ["clamping", "back_calculation"])
def test_the_limits_may_be_those_of_the_actuator(method: str) -> None:
    """A controller that is told what a limiter does acts as one that has the limits itself; without a delay."""
    text = f"""
model: m
actors:
  clock: {{type: Clock, period: 100 ms}}
  plant: {{type: TransferFunction, denominator: [1, 1]}}
  pid: {{type: PID, setpoint: 1, proportional: 3, integral: 4, anti_windup: {method}, LIMITS}}
  valve: {{type: Limiter, low: 0, high: 1.2}}
connections:
  - clock.output -> plant.trigger
  - plant.output -> pid.measurement
  - pid.output -> valve.input
  - valve.output -> plant.inputTRACKING
run: {{stop: 10 s, record: [plant.output]}}
"""
    own = Simulation(load(text.replace("LIMITS", "low: 0, high: 1.2").replace("TRACKING", ""))).run()
    told = Simulation(load(text.replace("LIMITS", "low: -99").replace("TRACKING", ", pid.tracking"))).run()
    blind = Simulation(load(text.replace("LIMITS", "low: -99").replace("TRACKING", ""))).run()
    assert told.signals["plant.output"].values.tolist() == own.signals["plant.output"].values.tolist()
    assert max(blind.signals["plant.output"].values) > max(own.signals["plant.output"].values) + 0.05


# -- without bumps -----------------------------------------------------------------------------------------------------


def test_control_goes_on_where_the_hand_has_left_it() -> None:
    inputs = {
        "measurement": [(float(k), 0.5) for k in range(7)],
        "automatic": [(1.0, False), (5.0, True)],
        "manual": [(2.0, 3.0), (3.0, 9.0)],
    }
    found = control(inputs=inputs, setpoint=1, proportional=2, integral=1, high=6)
    # By hand: what it was, then 3, then 9, cut off at 6; then it goes on from there.
    assert found.tokens("output") == [1.0, 1.0, 3.0, 6.0, 6.0, 6.0, 6.0]
    low = control(inputs={**inputs, "manual": [(2.0, 3.0)]}, setpoint=1, proportional=2, integral=1)
    assert low.tokens("output") == [1.0, 1.0, 3.0, 3.0, 3.0, 3.0, 3.5]


def test_new_gains_make_no_bump_if_there_is_an_integral() -> None:
    inputs = {"measurement": [(float(k), 0.0) for k in range(4)], "proportional": [(2.0, 5.0)]}
    assert control(inputs=inputs, setpoint=1, proportional=2, integral=1).tokens("output") == [2.0, 3.0, 4.0, 5.0]
    assert control(inputs=inputs, setpoint=1, proportional=2).tokens("output") == [2.0, 2.0, 5.0, 5.0]


def test_it_restarts_as_it_began() -> None:
    harness = control(1.0, {"measurement": [(0.0, 0.0), (1.0, 0.0)]}, setpoint=1, integral=1, derivative=1, initial=0.5)
    assert harness.tokens("output") == [1.5, 2.5]
    harness.actor.restart()
    harness.run(3.0, measurement=[(3.0, 0.0)])
    assert harness.last("output") == 1.5


# -- in loops ---------------------------------------------------------------------------------------------------------


def test_a_sampled_loop_obeys_its_difference_equation() -> None:
    """PI at a lag: two states, whose matrix the closed loop has; SciPy steps it."""
    text = """
model: m
actors:
  clock: {type: Clock, period: 200 ms}
  plant: {type: TransferFunction, numerator: [2], denominator: [1, 1]}
  pid: {type: PID, setpoint: 1, proportional: 0.8, integral: 1.5}
connections: [clock.output -> plant.trigger, plant.output -> pid.measurement, pid.output -> plant.input]
run: {stop: 12 s, record: [plant.output]}
"""
    q, h = math.exp(-0.2), 0.2
    # y+ = q y + 2 (1 - q) (Kp (r - y) + I);  I+ = I + Ki h (r - y)
    b = 2 * (1 - q)
    a_closed = np.array([[q - b * 0.8, b], [-1.5 * h, 1.0]])
    b_closed = np.array([[b * 0.8], [1.5 * h]])
    _, wanted, _ = scipy.signal.dlsim((a_closed, b_closed, [[1, 0]], [[0]], h), np.ones(61))
    found = Simulation(load(text)).run().signals["plant.output"].values
    assert found == pytest.approx(wanted.ravel(), abs=1e-12)
    assert found[-1] == pytest.approx(1.0, abs=1e-3)


def test_a_fast_sampled_loop_is_the_continuous_one() -> None:
    """PID with a lag at a plant of second order: at 1 ms, the closed loop of SciPy's transfer functions."""
    text = """
model: m
actors:
  clock: {type: Clock, period: 1 ms}
  plant: {type: TransferFunction, denominator: [1, 0.8, 4]}
  pid: {type: PID, setpoint: 1, proportional: 10, integral: 8, derivative: 4, filter_time: 50 ms}
connections: [clock.output -> plant.trigger, plant.output -> pid.measurement, pid.output -> plant.input]
run: {stop: 5 s, record: [plant.output]}
"""
    plant = np.array([1, 0.8, 4])
    lag = np.array([0.05, 1])
    # y = P u, u = (Kp + Ki / s) (r - y) - Kd s / (T s + 1) y
    forward = np.polymul([10, 8], lag)  # over s (T s + 1)
    back = np.polyadd(forward, [4, 0, 0])
    closed = np.polyadd(np.polymul(np.polymul([1, 0], lag), plant), back)
    times = np.arange(5001) / 1000
    _, wanted = scipy.signal.step((forward, closed), T=times)
    found = Simulation(load(text)).run().signals["plant.output"].values
    assert np.abs(found - wanted).max() < 2e-3


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"low": 2, "high": 1}, "low is 2 and high is 1: low must not be above high"),
        ({"tracking_time": 1}, "tracking_time: it is for 'anti_windup: back_calculation', but anti_windup is clamping"),
        ({"anti_windup": "clampin"},
         "it: PID.anti_windup: 'clampin' is not one of clamping, back_calculation, none, did you mean 'clamping'?"),
        ({"filter_time": "-1 s"}, "it: PID.filter_time: -1 is out of bounds, expected a number in s >= 0"),
    ],
)  # fmt: skip
def test_controllers_that_are_none(parameters: dict[str, Any], message: str) -> None:
    with pytest.raises(ParameterError) as caught:
        PID("it", **parameters)
    assert str(caught.value) == message
