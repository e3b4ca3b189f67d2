"""The Newton step of a linear-quadratic control problem against the dense system."""

import importlib

import numba
import numpy as np
import pytest

from tests.actors.robotics.numerics.numerics_parts import PREFIX, Floats, packed, spread

horizon = importlib.import_module(PREFIX + "horizon")
newton = importlib.import_module(PREFIX + "newton")
# Called by kernels only; numba looks them up as globals.
newton_step, step_column, stage_columns = newton.newton_step, newton.step_column, newton.stage_columns
ZERO = {2: (0.0, 0.0), 3: (0.0, 0.0, 0.0)}


@numba.njit
def riccati(
    position: np.ndarray, velocity: np.ndarray, control: np.ndarray, period: float, free: int, zero: Floats
) -> tuple[float, np.ndarray]:
    size, step = position.shape[1], step_column(len(zero))
    stages = np.zeros((len(control), stage_columns(len(zero))))
    stages[:, :size] = position
    stages[:, size : 2 * size] = velocity
    stages[:, 2 * size : 3 * size] = control
    return newton_step(stages, period, free, zero), stages[:, step : step + len(zero)].copy()


@pytest.mark.slow
@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize(("steps", "free"), [(3, 3), (10, 10), (40, 40), (10, 9), (10, 4), (10, 1), (40, 7)])
def test_newton_step_is_that_of_the_dense_system(random: np.random.Generator, steps: int, free: int, d: int) -> None:
    """Where the last free control is held, it is the dense system of the free ones."""
    held = np.zeros((d * free, d * steps))
    for column in range(d * steps):
        held[min(column, d * (free - 1) + column % d), column] = 1.0
    for _ in range(20 if d == 2 else 5):
        blocks = []
        for scale in 10.0 ** random.uniform(-1.0, 1.0, size=3):
            curvature = [scale * spread(random, d) for _ in range(steps)]
            blocks.append([(*random.normal(size=d), *packed(c)) for c in curvature])
        gradient, hessian = np.zeros(d * steps), np.zeros((d * steps, d * steps))
        for kind, table in enumerate(np.array(blocks)):
            for s, function in enumerate(table):
                block = np.zeros((d, d))
                block[np.triu_indices(d)] = function[d:]
                block = block + block.T - np.diag(block.diagonal())
                # What P_s, V_s or U_s is of all controls, from the dynamics with a unit control each.
                units = np.eye(d * steps).reshape(d * steps, steps, d)
                driven = [
                    horizon.trajectory(np.zeros(d), np.zeros(d), each, 0.1, steps + 1)[[s, s + 1]] for each in units
                ]
                reached = (
                    np.array([each[0] for each in driven]),
                    np.array([(each[1] - each[0]) / 0.1 for each in driven]),
                    units[:, s],
                )[kind]
                gradient += reached @ function[:d]
                hessian += reached @ block @ reached.T
        descent, step = riccati(*np.array(blocks), 0.1, free, ZERO[d])
        expected = held.T @ np.linalg.solve(held @ hessian @ held.T, -held @ gradient)
        assert step.ravel() == pytest.approx(expected, rel=1e-8, abs=1e-10)
        assert descent == pytest.approx(gradient @ expected)


@pytest.mark.slow
@pytest.mark.parametrize("d", [2, 3])
def test_a_block_that_is_no_bowl_counts_as_the_nearest_one(random: np.random.Generator, d: int) -> None:
    """The step is that of the blocks with their eigenvalues of less than 1e-9 raised to it."""
    flat = np.zeros((6, d + d * (d + 1) // 2))
    controls = flat.copy()
    controls[:, d:] = packed(np.eye(d))
    for _ in range(20):
        positions, mended = random.normal(size=flat.shape), flat.copy()
        mended[:, :d] = positions[:, :d]
        for row in range(len(flat)):
            block = np.zeros((d, d))
            block[np.triu_indices(d)] = positions[row, d:]
            values, axes = np.linalg.eigh(block, UPLO="U")
            mended[row, d:] = packed(axes @ np.diag(np.maximum(values, 1e-9)) @ axes.T)
        descent, step = riccati(positions, flat, controls, 0.5, 6, ZERO[d])
        expected, nearest = riccati(mended, flat, controls, 0.5, 6, ZERO[d])
        assert descent == pytest.approx(expected, rel=1e-9)
        assert step == pytest.approx(nearest, rel=1e-8, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("curvature", [(-1.0, 0.0, -2.0), (1.0, 2.0, 1.0), (np.nan, 0.0, 1.0)])
def test_where_the_cost_of_controls_is_no_bowl_there_is_no_descent(curvature: tuple[float, float, float]) -> None:
    flat, controls = np.zeros((3, 5)), np.array([[1.0, 1.0, 1.0, 0.0, 1.0]] * 3)
    assert riccati(flat, flat, controls, 0.1, 3, ZERO[2])[0] < 0.0
    controls[1, 2:] = curvature
    assert riccati(flat, flat, controls, 0.1, 3, ZERO[2])[0] == 0.0
