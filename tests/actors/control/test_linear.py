"""Linear systems: against scipy.signal, closed forms, and exponentials of many digits."""

from __future__ import annotations

import math
from typing import Any

import mpmath
import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st

from epicycle.actors import EpicycleError, ParameterError, StateSpace, TransferFunction
from epicycle.actors.control.matrices import Exponential, balanced
from epicycle.actors.testing import Harness
from epicycle.runner import ActorError, Simulation
from tests.actors.feeding import Events, feed, load, tokens

LAG = {"type": "TransferFunction", "denominator": [1, 1]}


def moments(count: int, end: float, seed: int) -> list[float]:
    """Irregular times of whole nanoseconds, the first at 0."""
    found = np.sort(np.random.default_rng(seed).uniform(0.0, end, count))
    return [0.0, *np.unique(np.round(found, 9)).tolist()]


# -- the exponential --------------------------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(size=st.integers(1, 5), seed=st.integers(0, 10**6), length=st.floats(1e-6, 300.0))
def test_exponential_is_exact_to_rounding(size: int, seed: int, length: float) -> None:
    random = np.random.default_rng(seed)
    matrix = random.normal(size=(size, size)) * 10.0 ** random.uniform(-4, 4, size=(size, size))
    time = length / float(np.linalg.norm(matrix))
    with mpmath.workdps(60):
        wanted = mpmath.expm(mpmath.matrix((matrix).tolist()) * mpmath.mpf(time)) - mpmath.eye(size)
    wanted = np.array(wanted.tolist(), float)
    found = np.array(Exponential(matrix.tolist()).less_one(time))
    assert np.abs(found - wanted).max() <= 1e-13 * np.abs(wanted).max()


def test_slow_motion_keeps_its_digits_beside_fast_motion() -> None:
    """Where plain squaring would leave a few, as 2^20 roundings of 1 add up."""
    found = Exponential([[-1e6, 0.0], [0.0, -1e-6]]).less_one(1.0)
    assert found[1][1] == pytest.approx(math.expm1(-1e-6), rel=1e-15)
    assert found[0][0] == -1.0


def test_balancing_is_exact_and_makes_rows_and_columns_alike() -> None:
    matrix = [[1.0, 1e8, 0.0], [1e-8, 2.0, 1e-6], [0.0, 1e6, 3.0]]
    rows, scales = balanced(matrix)
    assert all(math.frexp(scale)[0] == 0.5 for scale in scales)
    assert [[a * scales[i] / scales[j] for j, a in enumerate(row)] for i, row in enumerate(rows)] == matrix
    assert max(sum(map(abs, row)) for row in rows) < 6.0


# -- continuous systems ---------------------------------------------------------------------------------------------


def held_response(a: Any, b: Any, c: Any, d: Any, start: Any, inputs: Events, times: list[float]) -> Any:
    """The output at times, by SciPy: from one event to the next, each with a constant input."""
    state, given, at, found = np.array(start, float), np.zeros(np.shape(b)[1]), 0.0, []
    events = sorted([(time, 0, u) for time, u in inputs] + [(time, 1, None) for time in times], key=lambda e: e[:2])
    for time, kind, u in events:
        if time > at:
            _, _, states = scipy.signal.lsim(
                (a, b, np.eye(len(a)), np.zeros(np.shape(b))),
                [given, given], [0.0, time - at], X0=state, interp=False,
            )  # fmt: skip
            state, at = states[-1], time
        if kind == 0:
            given = np.atleast_1d(u).astype(float)
        else:
            found.append(np.asarray(c) @ state + np.asarray(d) @ given)
    return np.array(found)


@pytest.mark.parametrize("seed", range(6))
def test_state_space_is_what_scipy_gives(seed: int) -> None:
    random = np.random.default_rng(seed)
    n, m, p = (int(each) for each in random.integers(1, 4, size=3))
    a, b = random.normal(size=(n, n)) - np.eye(n), random.normal(size=(n, m))
    c, d = random.normal(size=(p, n)), random.normal(size=(p, m)) * (seed % 2)
    start = random.normal(size=n)
    looks = moments(60, 10.0, seed)
    inputs = [
        (time, random.normal(size=m).tolist() if m > 1 else float(random.normal()))
        for time in moments(20, 9.0, 50 + seed)
    ]
    system = StateSpace("it", a=a.tolist(), b=b.tolist(), c=c.tolist(), d=d.tolist(), initial=start.tolist())
    harness = Harness(system)
    harness.run(10.0, trigger=[(time, 0) for time in looks], input=inputs)
    wanted = held_response(a, b, c, d, start, inputs, looks)
    found = np.array([np.atleast_1d(token) for token in harness.tokens("output")])
    assert found == pytest.approx(wanted, rel=1e-10, abs=1e-11)
    assert [time for time, _ in harness.sent["output"]] == looks


@pytest.mark.parametrize("damping", [0.0, 0.2, 1.0, 3.0])
def test_step_of_a_second_order_system_is_the_closed_form(damping: float) -> None:
    w = 2.0
    plant = TransferFunction("it", numerator=[w * w], denominator=[1, 2 * damping * w, w * w])
    harness = Harness(plant)
    times = [k / 16 for k in range(200)]
    harness.run(20.0, trigger=[(t, 0) for t in times], input=[(0.0, 1.0)])
    t = np.array(times)
    if damping < 1:
        wd = w * math.sqrt(1 - damping**2)
        wanted = 1 - np.exp(-damping * w * t) * (np.cos(wd * t) + damping * w / wd * np.sin(wd * t))
    elif damping == 1:
        wanted = 1 - np.exp(-w * t) * (1 + w * t)
    else:
        root = math.sqrt(damping**2 - 1)
        fast, slow = -w * (damping + root), -w * (damping - root)
        wanted = 1 + (slow * np.exp(fast * t) - fast * np.exp(slow * t)) / (fast - slow)
    assert harness.tokens("output") == pytest.approx(wanted.tolist(), abs=3e-14)


def test_step_of_a_stiff_filter_of_fourth_order() -> None:
    """Coefficients from 1 to 1e12: without balancing few digits would be left."""
    plant = TransferFunction("it", numerator=[1e12], denominator=[1, 4e3, 6e6, 4e9, 1e12])
    harness = Harness(plant)
    times = [k / 1000 for k in range(20)]
    harness.run(0.02, trigger=[(t, 0) for t in times], input=[(0.0, 1.0)])
    x = 1000 * np.array(times)
    wanted = 1 - np.exp(-x) * (1 + x + x**2 / 2 + x**3 / 6)
    assert harness.tokens("output") == pytest.approx(wanted.tolist(), abs=1e-14)


@pytest.mark.parametrize(
    ("numerator", "denominator"),
    [
        ([1], [1, 3, 3, 1]),
        ([2, 1], [1, 0.4, 4]),
        ([1, 0, 5], [2, 3, 1]),
        ([3], [1, 0]),
        ([4], [2]),
        ([0, 0, 1], [1, 2]),
    ],
)
def test_transfer_functions_step_as_scipy_says(numerator: list[float], denominator: list[float]) -> None:
    times = [k / 10 for k in range(100)]
    harness = Harness(TransferFunction("it", numerator=numerator, denominator=denominator))
    harness.run(10.0, trigger=[(t, 0) for t in times], input=[(0.0, 1.0)])
    stripped = np.trim_zeros(numerator, "f")
    if len(denominator) == 1:
        wanted = np.full(100, stripped[0] / denominator[0])
    else:
        wanted = scipy.signal.step((stripped, denominator), T=times)[1]
    assert harness.tokens("output") == pytest.approx(wanted.tolist(), abs=1e-12)


def test_initial_values_are_the_output_and_its_derivatives() -> None:
    """y''' + 6 y'' + 11 y' + 6 y = u' + u: without input a sum of exponentials of -1, -2, -3."""
    start = [2.0, -1.0, 4.0]
    harness = Harness(TransferFunction("it", numerator=[1, 1], denominator=[1, 6, 11, 6], initial=start))
    times = [k / 8 for k in range(40)]
    harness.run(5.0, trigger=[(t, 0) for t in times])
    poles = np.array([-1.0, -2.0, -3.0])
    weights = np.linalg.solve(np.vander(poles, increasing=True).T, start)
    wanted = [float(np.sum(weights * np.exp(poles * t))) for t in times]
    assert harness.tokens("output") == pytest.approx(wanted, abs=1e-13)


def test_an_input_may_be_held_from_the_start() -> None:
    harness = Harness(TransferFunction("it", numerator=[5], denominator=[2, 1], initial=[10], held=2))
    harness.run(9.0, trigger=[(9.0, 0)])
    assert harness.last("output") == pytest.approx(10.0, rel=1e-15)  # in balance: 5 times 2


def test_looks_leave_no_trace() -> None:
    inputs = [(0.0, 1.0), (0.3, -2.0), (0.3, 0.5), (1.1, 0.5), (2.0, 3.0)]
    ends = set()
    for looks in ([5.0], [0.0, 0.1, 0.3, 0.31, 1.1, 4.999, 5.0], [k / 100 for k in range(501)]):
        harness = Harness(TransferFunction("it", numerator=[1, 2], denominator=[1, 0.5, 2]))
        harness.run(5.0, trigger=[(t, 0) for t in looks], input=inputs)
        ends.add(harness.last("output").hex())
    assert len(ends) == 1


def test_an_input_acts_from_its_own_time_on() -> None:
    """A step between two looks; and a direct part is seen at once, at the same tag."""
    harness = Harness(StateSpace("it", a=[[0]], b=[[1]], d=[[10]]))
    harness.run(3.0, trigger=[(0.0, 0), (1.0, 0), (2.0, 0)], input=[(0.25, 4.0), (2.0, 0.0)])
    assert harness.tokens("output") == [0.0, 0.75 * 4 + 40, 1.75 * 4]


LOOP = """
model: loop
actors:
  clock: {type: Clock, period: 100 ms}
  plant: {type: PLANT}
  gain: {type: Scale, factor: -2}
connections:
  - clock.output -> plant.trigger
  - plant.output -> gain.input
  - gain.output -> plant.input
run: {stop: 5 s, record: [plant.output]}
"""


def test_a_plant_without_direct_part_stands_in_a_loop_without_delay() -> None:
    """x' = -x + u with u = -2 x held over 0.1 s is x[k+1] = (q - 2 (1 - q)) x[k], with q = exp(-0.1)."""
    text = LOOP.replace("PLANT", "TransferFunction, denominator: [1, 1], initial: [1]")
    results = Simulation(load(text)).run()
    q = math.exp(-0.1)
    assert results.signals["plant.output"].values == pytest.approx(
        [(q - 2 * (1 - q)) ** k for k in range(51)], abs=1e-14
    )


def test_a_plant_with_a_direct_part_does_not() -> None:
    from epicycle.runner.model.text.problems import ModelError

    with pytest.raises(ModelError, match="loop without delay"):
        Simulation(load(LOOP.replace("PLANT", "TransferFunction, numerator: [1, 0], denominator: [1, 1]")))


def test_what_is_unstable_grows_until_it_cannot() -> None:
    harness = Harness(TransferFunction("it", denominator=[1, -1], initial=[1]))
    harness.fire(700.0, trigger=0)
    assert harness.last("output") == pytest.approx(math.exp(700), rel=1e-12)
    with pytest.raises(
        EpicycleError, match=r"^the state has grown too large for a float: the system is unstable; end the"
    ):
        harness.fire(720.0, trigger=0)


# -- sampled systems ------------------------------------------------------------------------------------------------


def test_sampled_state_space_is_dlsim() -> None:
    random = np.random.default_rng(3)
    a, b, c = random.normal(size=(3, 3)) * 0.4, random.normal(size=(3, 2)), random.normal(size=(2, 3))
    for d in (np.zeros((2, 2)), random.normal(size=(2, 2))):
        u = random.normal(size=(30, 2))
        start = [1.0, 2.0, 3.0]
        harness = Harness(
            StateSpace("it", a=a.tolist(), b=b.tolist(), c=c.tolist(), d=d.tolist(), initial=start, sampled=True)
        )
        harness.run(99.0, trigger=[(k, 0) for k in range(30)], input=[(k, u[k].tolist()) for k in range(30)])
        _, wanted, _ = scipy.signal.dlsim((a, b, c, d, 1.0), u, x0=start)
        assert np.array(harness.tokens("output")) == pytest.approx(wanted, abs=1e-12)


def test_sampled_transfer_function_is_lfilter() -> None:
    numerator, denominator = [0.1, 0.2, 0.05], [1, -1.2, 0.5]
    u = np.random.default_rng(4).normal(size=40).tolist()
    harness = Harness(TransferFunction("it", numerator=numerator, denominator=denominator, sampled=True))
    harness.run(99.0, trigger=[(k, 0) for k in range(40)], input=list(enumerate(u)))
    assert harness.tokens("output") == pytest.approx(
        scipy.signal.lfilter(numerator, denominator, u).tolist(), abs=1e-13
    )


def test_a_step_takes_the_input_of_its_own_time() -> None:
    """What comes between two steps counts from the next one; what comes with a step, from this one."""
    harness = Harness(StateSpace("it", a=[[0]], b=[[1]], sampled=True, held=[7]))
    harness.run(9.0, trigger=[(k, 0) for k in range(5)], input=[(1.0, 1.0), (1.5, 2.0), (3.0, 3.0)])
    assert harness.tokens("output") == [0.0, 7.0, 1.0, 2.0, 3.0]


# -- what is wrong ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "parameters", "message"),
    [
        (StateSpace, {"a": [[1, 2]], "b": [[1]]}, "a: 1 x 2, expected 1 x 1: it must be square"),
        (StateSpace, {"a": [[1, 2], [3]], "b": [[1]]},
         "it: StateSpace.a: [[1, 2], [3]] is not a matrix: its rows differ in length"),
        (StateSpace, {"a": [[0]], "b": [[1], [1]]}, "b: 2 x 1, expected 1 x 1: a row for each of 1 state"),
        (StateSpace, {"a": [[0]], "b": [[1]], "c": [[1, 2]]},
         "c: 1 x 2, expected 1 x 1: a column for each of 1 state"),
        (StateSpace, {"a": [[0]], "b": [[1]], "d": [[1], [2]]},
         "d: 2 x 1, expected 1 x 1: a row for each output and a column for each input"),
        (StateSpace, {"a": [[0]], "b": [[1]], "initial": [1, 2]}, "initial: 2 numbers for 1 state"),
        (StateSpace, {"a": [[0]], "b": [[1]], "held": [1, 2]}, "held: 2 numbers for 1 input"),
        (StateSpace, {"a": [[math.inf]], "b": [[1]]}, "a: the numbers [inf] are not all finite"),
        (TransferFunction, {"numerator": [1, 0], "denominator": [1]},
         ("numerator: its degree 1 is above that of the denominator, 0: the system would differentiate its input, "
          "which jumps")),
        (TransferFunction, {"denominator": [0, 1]},
         "denominator: the first coefficient, that of the highest power, must not be 0 or missing"),
        (TransferFunction, {"denominator": []},
         "denominator: the first coefficient, that of the highest power, must not be 0 or missing"),
        (TransferFunction, {"denominator": [1.0] * 101},
         ("100 states and 1 input are more than 100 in total, and the matrix exponential would take long; use "
          "several systems, or 'sampled' ones")),
        (TransferFunction, {"denominator": [1, 1], "initial": [1, 2]}, ("initial: 2 values, expected at most 1, the "
                                                                       "order of the system")),
    ],
)  # fmt: skip
def test_systems_that_are_none(kind: Any, parameters: dict[str, Any], message: str) -> None:
    with pytest.raises(ParameterError) as caught:
        kind("it", **parameters)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("actor", "token", "message"),
    [
        (LAG, "fast", "it.input got 'fast', expected a finite number"),
        pytest.param(LAG, 10**400, f"it.input got 1{'0' * 56}..., expected a finite number", id="huge"),
        (LAG, True, "it.input got true, expected a finite number"),
        ({"type": "StateSpace", "a": [[0]], "b": [[1, 2]]}, [1.0],
         "it.input got [1.0], expected a list of 2 numbers"),
    ],
)  # fmt: skip
def test_inputs_that_are_none(actor: dict[str, Any], token: Any, message: str) -> None:
    with pytest.raises(ActorError) as caught:
        feed(actor, {"trigger": [(1.0, 0)], "input": [(0.0, token)]})
    assert caught.value.reason == message


def test_one_number_goes_in_and_out_bare_and_several_as_arrays() -> None:
    _, sent, _ = feed(
        {"type": "StateSpace", "a": [[0, 1], [0, 0]], "b": [[0], [1]]},
        {"trigger": [(1.0, 0)], "input": [(0.0, 2)]},
    )
    (state,) = tokens(sent)
    assert state.tolist() == [1.0, 2.0]
    assert not state.flags.writeable
    assert StateSpace("s", a=[[0]], b=[[1]]).output.type is float
