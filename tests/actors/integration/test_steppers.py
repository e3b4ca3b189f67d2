"""The steppers behind ODE: their orders, SciPy's solve_ivp, closed forms, and what their bits may hang on."""

from __future__ import annotations

import ast
import functools
import math
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest
import scipy.integrate

import epicycle.actors.continuous
from epicycle.actors.integration import STEPPERS, Limits, State, Stepper
from epicycle.actors.integration.newton import Factors, Jacobian
from epicycle.actors.integration.stepper import root_power
from epicycle.actors.solution import root

EXPLICIT = ("RK23", "RK45", "DOP853")

ADAPTIVE = [method for method in STEPPERS if method != "Euler"]  # which has neither tolerances nor an order to choose


def circle(time: float, state: State) -> State:
    return [-state[1], state[0]]


def lotka_volterra(time: float, state: State) -> State:
    x, y = state
    return [x - x * y, x * y - y]


def van_der_pol(time: float, state: State) -> State:
    x, v = state
    return [v, 1000.0 * (1.0 - x * x) * v - x]


def robertson(time: float, state: State) -> State:
    a, b, c = state
    first, second, third = 0.04 * a, 1e4 * b * c, 3e7 * b * b
    return [second - first, first - second - third, third]


def seasons(time: float, state: State) -> State:
    return [-1e4 * (state[0] - math.cos(time)) - math.sin(time)]


def solved(
    method: str, rates: Callable[[float, State], State], start: State, until: float, tolerance: float
) -> tuple[State, Stepper, int]:
    """The state at a time, the stepper, and how many steps it took."""
    stepper = STEPPERS[method](rates, start, Limits(tolerance, tolerance * 1e-3, math.inf))
    steps = 0
    while stepper.time < until:
        assert stepper.step()
        steps += 1
    return stepper.piece().at(until), stepper, steps


@pytest.mark.parametrize(
    ("method", "order", "between"), [("RK23", 3, 3), ("RK45", 5, 4), ("DOP853", 8, 7), ("Radau", 5, 3)]
)
def test_errors_fall_with_the_order_of_the_method(method: str, order: int, between: int) -> None:
    """With steps of one length, of half, of a quarter: at their ends, and along the polynomials between these."""
    ends, along = [], []
    first = 0.5 if method == "DOP853" else 0.125
    for step in (first, first / 2, first / 4):
        stepper = STEPPERS[method](circle, [1.0, 0.0], Limits(1e-3 if method == "Radau" else 1e6, 1e6, step))
        worst = 0.0
        stepper.next_step = step
        while stepper.time < 4.0:
            before = stepper.time
            assert stepper.step()
            piece = stepper.piece()
            assert (piece.start, piece.end) == (before, stepper.time)
            for part in range(11):
                time = before + step * part / 10
                x, y = piece.at(time)
                worst = max(worst, abs(x - math.cos(time)), abs(y - math.sin(time)))
        assert stepper.time == pytest.approx(4.0, abs=1e-12)
        ends.append(abs(stepper.state[0] - math.cos(4.0)) + abs(stepper.state[1] - math.sin(4.0)))
        along.append(worst)
    for errors, wanted in ((ends, order), (along, between)):
        for coarse, fine in pairwise(errors):
            assert math.log2(coarse / fine) > wanted - 0.35


@pytest.mark.parametrize(("method", "order"), [("RK23", 2), ("RK45", 4), ("DOP853", 7), ("Radau", 3), ("BDF", 5)])
def test_steps_become_longer_with_the_tolerance_as_the_order_says(method: str, order: int) -> None:
    """The error that steps are chosen by is of an order p, so their number goes with tolerance ** (-1 / (p + 1))."""
    loose, tight = 1e-5, 1e-8
    counts = [solved(method, lotka_volterra, [2.0, 1.0], 10.0, tolerance)[2] for tolerance in (loose, tight)]
    grown = math.log(counts[1] / counts[0]) / math.log(loose / tight)
    assert grown == pytest.approx(1 / (order + 1), rel=0.35)


@pytest.mark.parametrize("method", ADAPTIVE)
@pytest.mark.parametrize(("rates", "start", "until"), [(circle, [1.0, 0.0], 7.3), (lotka_volterra, [2.0, 1.0], 12.0)])
def test_states_are_those_of_solve_ivp(
    method: str, rates: Callable[[float, State], State], start: State, until: float
) -> None:
    tolerance = 1e-6 if method == "RK23" else 1e-8
    truth = scipy.integrate.solve_ivp(rates, (0, until), start, "DOP853", rtol=1e-13, atol=1e-14).y[:, -1].tolist()
    peer = scipy.integrate.solve_ivp(rates, (0, until), start, method, rtol=tolerance, atol=tolerance * 1e-3)
    ours, _, steps = solved(method, rates, start, until, tolerance)
    theirs = peer.y[:, -1].tolist()
    error, peers = (max(abs(x - y) for x, y in zip(values, truth, strict=True)) for values in (ours, theirs))
    assert error < max(3.0 * peers, 10.0 * tolerance)
    assert steps <= 1.1 * peer.t.size + 2


@functools.cache
def true_state(rates: Callable[[float, State], State], start: tuple[float, ...], until: float) -> list[float]:
    solution = scipy.integrate.solve_ivp(rates, (0, until), start, "BDF", rtol=1e-8, atol=1e-11)
    return solution.y[:, -1].tolist()  # type: ignore[no-any-return]


@pytest.mark.parametrize("method", ["Radau", "BDF"])
@pytest.mark.parametrize(
    ("rates", "start", "until"),
    [(van_der_pol, [2.0, 0.0], 1000.0), (robertson, [1.0, 0.0, 0.0], 1e4), (seasons, [0.0], 20.0)],
)
def test_stiff_systems_cost_what_their_smooth_solutions_do(
    method: str, rates: Callable[[float, State], State], start: State, until: float
) -> None:
    tolerance = 1e-6
    truth = true_state(rates, tuple(start), until)
    peer = scipy.integrate.solve_ivp(rates, (0, until), start, method, rtol=tolerance, atol=tolerance * 1e-3)
    ours, _, steps = solved(method, rates, start, until, tolerance)
    assert ours == pytest.approx(truth, rel=1e-3, abs=1e-7)
    assert steps <= 1.1 * peer.t.size + 2


def test_a_stiff_system_is_dear_for_explicit_methods_alone() -> None:
    counts = {
        method: solved(method, lambda time, state: [-1e3 * (state[0] - 1.0)], [0.0], 10.0, 1e-4)[2]
        for method in ADAPTIVE
    }
    assert min(counts[method] for method in EXPLICIT) > 1000
    assert max(counts[method] for method in ("Radau", "BDF")) < 80


@pytest.mark.parametrize("method", ADAPTIVE)
def test_bounds_hold_what_the_polynomial_takes(method: str) -> None:
    stepper = STEPPERS[method](lotka_volterra, [2.0, 1.0], Limits(1e-4, 1e-7, math.inf))
    for _ in range(30):
        assert stepper.step()
        piece = stepper.piece()
        width = piece.end - piece.start
        for left, right in ((0.0, 1.0), (0.0, 0.25), (0.4, 0.5), (0.9, 1.0)):
            bounds = piece.bounds(piece.start + left * width, piece.start + right * width)
            for part in range(11):
                state = piece.at(piece.start + (left + (right - left) * part / 10) * width)
                for (low, high), value in zip(bounds, state, strict=True):
                    assert low - 1e-15 <= value <= high + 1e-15
                    assert high - low < 10.0 * width * (right - left) + 1e-12


@pytest.mark.parametrize("method", ADAPTIVE)
@pytest.mark.parametrize("rates", [lambda time, state: [math.nan], lambda time, state: [state[0] * state[0] * 1e3]])
def test_where_no_step_is_short_enough_there_is_none(method: str, rates: Callable[[float, State], State]) -> None:
    """NaN from the start, and a solution that is infinite after a millisecond."""
    stepper = STEPPERS[method](rates, [1.0], Limits(1e-8, 1e-10, math.inf))
    for _ in range(10_000):
        if not stepper.step():
            break
    else:
        raise AssertionError("it goes on and on")
    assert stepper.time == pytest.approx(0.0 if math.isnan(rates(0.0, [1.0])[0]) else 1e-3, rel=1e-2)


@pytest.mark.parametrize("method", ADAPTIVE)
def test_steps_are_no_longer_than_they_may_be(method: str) -> None:
    stepper = STEPPERS[method](lambda time, state: [1.0], [0.0], Limits(1e-6, 1e-9, 0.25))
    times = [0.0]
    while stepper.time < 10.0:
        assert stepper.step()
        times.append(stepper.time)
    assert max(right - left for left, right in pairwise(times)) == pytest.approx(0.25, rel=1e-12)
    assert stepper.state[0] == pytest.approx(stepper.time, rel=1e-12)


def test_systems_are_solved_with_the_largest_pivots() -> None:
    matrix = [[1e-20, 1.0, 0.0], [1.0, 1.0, 2.0], [3.0, -1.0, 4.0]]
    wanted = [1.0, 2.0, 3.0]
    right = [math.fsum(a * x for a, x in zip(row, wanted, strict=True)) for row in matrix]
    assert Factors(matrix).solve(right) == pytest.approx(wanted, rel=1e-14)
    assert matrix[0] == [1e-20, 1.0, 0.0]
    with pytest.raises(ZeroDivisionError):
        Factors([[1.0, 2.0], [2.0, 4.0]])


def test_the_jacobian_is_that_of_the_derivatives() -> None:
    jacobian = Jacobian(robertson, 3, 1e-10)
    state = [0.9, 1e-5, 0.1]
    for _ in range(4):  # the widths are learnt
        found = jacobian.at(0.0, state, robertson(0.0, state))
    assert found[0] == pytest.approx([-0.04, 1e4 * 0.1, 1e4 * 1e-5], rel=1e-4)
    assert found[1] == pytest.approx([0.04, -1e4 * 0.1 - 6e7 * 1e-5, -1e4 * 1e-5], rel=1e-4)
    assert found[2] == pytest.approx([0.0, 6e7 * 1e-5, 0.0], rel=1e-4)


@pytest.mark.parametrize(
    ("function", "left", "right", "zero"),
    [
        (lambda x: x * x - 2.0, 0.0, 2.0, math.sqrt(2.0)),
        (lambda x: math.cos(x) - x, 0.0, 1.0, 0.7390851332151607),
        (lambda x: (x - 1.0) ** 9, 0.0, 3.0, 1.0),
        (lambda x: 1.0 if x > 0.3 else -1.0, 0.0, 1.0, 0.3),
        (lambda x: math.expm1(-50.0 * (x - 0.9)), 0.0, 1.0, 0.9),
        (lambda x: -math.inf if x < 0.6 else 1e-300, 0.0, 1.0, 0.6),
    ],
)
def test_roots_are_found_to_the_last_bits(
    function: Callable[[float], float], left: float, right: float, zero: float
) -> None:
    calls: list[float] = []

    def counted(x: float) -> float:
        calls.append(x)
        return function(x)

    assert root(counted, left, right) == pytest.approx(zero, rel=1e-15 if function(1.0) else 1e-14, abs=1e-15)
    assert len(calls) < 110
    assert root(function, right, left) == pytest.approx(zero, rel=1e-14, abs=1e-15)


@pytest.mark.parametrize("exponent", [1 / 2, 1 / 3, 1 / 5, 1 / 8, 0.99])
@pytest.mark.parametrize("base", [0.0, 1e-300, 3e-9, 0.7, 1.0, 12.0, 1e300])
def test_powers_of_square_roots(base: float, exponent: float) -> None:
    assert root_power(base, exponent) == pytest.approx(base**exponent, rel=0.05)


def test_nothing_but_plain_floats() -> None:
    """No array library, no linear algebra, no powers, no sums and no functions that differ between processors."""
    folder = Path(epicycle.actors.continuous.__file__).parent
    files = [*(folder / "integration").glob("*.py"), folder / "solution.py", folder / "continuous.py"]
    assert len(files) == 11
    for file in files:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            where = f"{file.name}:{getattr(node, 'lineno', 0)}"
            modules = [each.name for each in node.names] if isinstance(node, ast.Import) else []
            modules += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not {"numpy", "scipy", "cmath", "statistics"} & {name.partition(".")[0] for name in modules}, where
            assert not (isinstance(node, ast.Name) and node.id in ("sum", "pow")), where
            assert not (isinstance(node, ast.Constant) and isinstance(node.value, complex)), where
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "math":
                assert node.attr in {"sqrt", "inf", "isfinite", "nextafter", "ulp"}, where
            assert not isinstance(node, (ast.Pow, ast.MatMult)), where
