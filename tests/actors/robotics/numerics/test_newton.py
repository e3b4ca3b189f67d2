"""The Newton step of a linear-quadratic control problem against the dense system."""

import importlib

import numba
import numpy as np
import pytest

from tests.actors.robotics.numerics.numerics_parts import PREFIX, spread

horizon = importlib.import_module(PREFIX + "horizon")
newton = importlib.import_module(PREFIX + "newton")
# Called by kernels only; numba looks them up as globals.
newton_step, STAGE = newton.newton_step, newton.STAGE
POSITION, VELOCITY, CONTROL, STEP = newton.POSITION, newton.VELOCITY, newton.CONTROL, newton.STEP


@numba.njit
def riccati(
    position: np.ndarray, velocity: np.ndarray, control: np.ndarray, period: float, free: int
) -> tuple[float, np.ndarray]:
    stages = np.zeros((len(control), STAGE))
    stages[:, POSITION : POSITION + 5] = position
    stages[:, VELOCITY : VELOCITY + 5] = velocity
    stages[:, CONTROL : CONTROL + 5] = control
    return newton_step(stages, period, free), stages[:, STEP : STEP + 2].copy()


@pytest.mark.parametrize(("steps", "free"), [(3, 3), (10, 10), (40, 40), (10, 9), (10, 4), (10, 1), (40, 7)])
def test_newton_step_is_that_of_the_dense_system(random: np.random.Generator, steps: int, free: int) -> None:
    """Where the last free control is held, it is the dense system of the free ones."""
    held = np.zeros((2 * free, 2 * steps))
    for column in range(2 * steps):
        held[min(column, 2 * (free - 1) + column % 2), column] = 1.0
    for _ in range(20):
        blocks = []
        for scale in 10.0 ** random.uniform(-1.0, 1.0, size=3):
            curvature = [scale * spread(random, 2) for _ in range(steps)]
            blocks.append([(*random.normal(size=2), c[0, 0], c[0, 1], c[1, 1]) for c in curvature])
        gradient, hessian = np.zeros(2 * steps), np.zeros((2 * steps, 2 * steps))
        for kind, table in enumerate(np.array(blocks)):
            for s, (gx, gy, xx, xy, yy) in enumerate(table):
                # What P_s, V_s or U_s is of all controls, from the dynamics with a unit control each.
                units = np.eye(2 * steps).reshape(2 * steps, steps, 2)
                driven = [
                    horizon.trajectory(np.zeros(2), np.zeros(2), each, 0.1, steps + 1)[[s, s + 1]] for each in units
                ]
                reached = (
                    np.array([each[0] for each in driven]),
                    np.array([(each[1] - each[0]) / 0.1 for each in driven]),
                    units[:, s],
                )[kind]
                gradient += reached @ [gx, gy]
                hessian += reached @ np.array([[xx, xy], [xy, yy]]) @ reached.T
        descent, step = riccati(*np.array(blocks), 0.1, free)
        expected = held.T @ np.linalg.solve(held @ hessian @ held.T, -held @ gradient)
        assert step.ravel() == pytest.approx(expected, rel=1e-8, abs=1e-10)
        assert descent == pytest.approx(gradient @ expected)


@pytest.mark.parametrize("curvature", [(-1.0, 0.0, -2.0), (1.0, 2.0, 1.0), (np.nan, 0.0, 1.0)])
def test_where_the_cost_of_controls_is_no_bowl_there_is_no_descent(curvature: tuple[float, float, float]) -> None:
    flat, controls = np.zeros((3, 5)), np.array([[1.0, 1.0, 1.0, 0.0, 1.0]] * 3)
    assert riccati(flat, flat, controls, 0.1, 3)[0] < 0.0
    controls[1, 2:] = curvature
    assert riccati(flat, flat, controls, 0.1, 3)[0] == 0.0
