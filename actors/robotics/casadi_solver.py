"""The horizon problem as a nonlinear program for CasADi and IPOPT; loaded only when it is asked for.

Written from the paper's equations, not from the barrier method's code, so that the two can check each other.
f6 is exact: each max(0, d - Dmax) is a variable t with t >= 0 and t >= d - Dmax.

An infeasible problem is solved in two stages, as the barrier method does: the sum of the squared violations
of f3-f5 is minimised first; then the objective, with each constraint bounded by its own least violation.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core import EpicycleError
from ..core.elementary import hypot
from .messages import Array
from .numerics.barrier import TOLERANCE, Solution
from .numerics.constraints import violations
from .numerics.horizon import INFORM, REACH_GOAL, HorizonProblem, roll_out

_SLACK = 1e-4  # m; what the second stage's bounds are widened by, so that they have an inside
_STRICT = 1.0 - 1e-7  # f1 and f2 are asked for a little more strictly than IPOPT's tolerance keeps them
_OPTIONS = {
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "print_time": False,
    "error_on_fail": False,
    "ipopt.tol": 1e-9,
    "ipopt.bound_relax_factor": 0.0,
    "ipopt.mu_init": 1e-2,
}


class SolverError(EpicycleError):
    """A solver that is not installed."""


def load_casadi() -> Any:
    """The casadi module, or a message that says how to get it."""
    try:
        import casadi
    except ImportError:
        raise SolverError(
            "the solver 'Casadi' needs a package that is not installed; pip install 'epicycle[casadi]'"
        ) from None
    return casadi


@dataclass(frozen=True, slots=True)
class _Program:
    """Both stages of one shape of problem, and how its numbers are laid out."""

    optimise: Any  # variables: controls, then one t a step if the objective is INFORM
    restore: Any  # variables: controls, then one violation for each of f3-f5
    coupled: int  # rows of f3-f5
    beyond: int  # rows of f6
    objective: Any  # function of (controls, parameters): the paper's own, with its kink


def solve(problem: HorizonProblem, starts: Array, max_iterations: int = 500) -> Solution:
    """Solve from ``starts[0]`` (k, N, 2); never raises."""
    steps = starts.shape[1]
    shape = (
        steps,
        len(problem.obstacle_mean),
        len(problem.peer_mean),
        problem.objective,
        len(problem.sigma_weights),
    )
    program = _program(*shape, max_iterations)
    numbers = _numbers(problem)
    limits = _limits(problem, steps)
    candidates = [start for start in starts if _respects_limits(problem, start)]
    start = candidates[0] if candidates else np.zeros((steps, 2))
    iterations = 0

    controls, taken = _optimise(program, numbers, limits, np.zeros(program.coupled), start, problem)
    iterations += taken
    if controls is None or _worst(problem, controls) > TOLERANCE:
        restored, taken = _restore(program, numbers, limits, start, problem)
        iterations += taken
        if restored is not None:
            candidates.append(restored)
            allowed = _coupled(problem, restored)
            bounds = np.where(allowed > -_SLACK, np.maximum(allowed, 0.0) + _SLACK, 0.0)
            better, taken = _optimise(program, numbers, limits, bounds, restored, problem)
            iterations += taken
            if better is not None and _worst(problem, better) <= _worst(problem, restored) + 2.0 * _SLACK:
                restored = better
                candidates.insert(0, better)
            if controls is None or _worst(problem, restored) < _worst(problem, controls):
                controls = restored
    if controls is None:
        controls = min(candidates, key=lambda each: _worst(problem, each)) if candidates else start
    worst = _worst(problem, controls)
    value = float(program.objective(controls.ravel(), numbers))
    return Solution(controls, worst if worst > TOLERANCE else 0.0, value, iterations)


def _optimise(
    program: _Program, numbers: Array, limits: Array, bounds: Array, start: Array, problem: HorizonProblem
) -> tuple[Array | None, int]:
    """Minimise the objective with f3-f5 at most ``bounds``; no controls if nothing usable came out."""
    first = np.concatenate([start.ravel(), _excess(problem, start) + 1e-3 if program.beyond else []])
    lower = np.concatenate([np.full(start.size, -np.inf), np.zeros(len(first) - start.size)])
    upper = np.concatenate([limits, bounds, np.zeros(program.beyond)])
    result = program.optimise(x0=first, p=numbers, lbx=lower, lbg=-np.inf, ubg=upper)
    return _controls(result, start, problem), int(program.optimise.stats()["iter_count"])


def _restore(
    program: _Program, numbers: Array, limits: Array, start: Array, problem: HorizonProblem
) -> tuple[Array | None, int]:
    """Minimise the sum of the squared violations of f3-f5."""
    first = np.concatenate([start.ravel(), np.maximum(_coupled(problem, start), 0.0) + 1e-2])
    lower = np.concatenate([np.full(start.size, -np.inf), np.zeros(program.coupled)])
    upper = np.concatenate([limits, np.zeros(program.coupled)])
    result = program.restore(x0=first, p=numbers, lbx=lower, lbg=-np.inf, ubg=upper)
    return _controls(result, start, problem), int(program.restore.stats()["iter_count"])


def _controls(result: Any, start: Array, problem: HorizonProblem) -> Array | None:
    controls = np.array(result["x"]).ravel()[: start.size].reshape(start.shape)
    return controls if np.isfinite(controls).all() and _respects_limits(problem, controls) else None


def _respects_limits(problem: HorizonProblem, controls: Array) -> bool:
    positions, velocities = np.empty_like(controls), np.empty_like(controls)
    roll_out(problem.position, problem.velocity, controls.copy(), problem.period, positions, velocities)
    slow = all(hypot(x, y) <= problem.max_speed for x, y in velocities[1:].tolist())
    return slow and all(hypot(x, y) <= problem.max_acceleration for x, y in controls.tolist())


def _worst(problem: HorizonProblem, controls: Array) -> float:
    return max(0.0, float(violations(problem, controls).max()))


def _coupled(problem: HorizonProblem, controls: Array) -> Array:
    """f3-f5 in the order of the program's rows; no control can change steps 1 and 2."""
    values = violations(problem, controls)[:, 2:].ravel()
    return np.where(np.isfinite(values), values, -1.0)


def _excess(problem: HorizonProblem, controls: Array) -> Array:
    positions, velocities = np.empty_like(controls), np.empty_like(controls)
    roll_out(problem.position, problem.velocity, controls.copy(), problem.period, positions, velocities)
    away = positions - problem.obstacle_mean[0]
    return np.array([max(hypot(x, y) - problem.measurement_range, 0.0) for x, y in away.tolist()])


def _limits(problem: HorizonProblem, steps: int) -> Array:
    speed, push = _STRICT * problem.max_speed, _STRICT * problem.max_acceleration
    return np.concatenate([np.full(steps - 1, speed * speed), np.full(steps, push * push)])


# --- the program --------------------------------------------------------------------------------------


def _fields(problem: HorizonProblem) -> list[Array]:
    """The problem's numbers, in the order of ``_program``'s symbols."""
    # A radius without bound would be inf - inf to IPOPT; this one is out of reach.
    radius = np.where(np.isfinite(problem.tube_radius), problem.tube_radius, 1e6)
    scalars = [
        problem.period,
        problem.safe_distance,
        problem.margin,
        problem.measurement_variance,
        problem.range_penalty,
        problem.measurement_range,
    ]
    return [
        np.array(scalars),
        problem.position,
        problem.velocity,
        problem.goal,
        problem.tube_centre,
        radius,
        problem.obstacle_mean,
        problem.obstacle_covariance,
        problem.peer_mean,
        problem.peer_distance,
        problem.sigma_positions,
        problem.sigma_weights,
        problem.others_distance,
    ]


def _numbers(problem: HorizonProblem) -> Array:
    return np.concatenate([np.ravel(field) for field in _fields(problem)])


@functools.lru_cache(maxsize=64)
def _program(steps: int, obstacles: int, peers: int, objective: int, points: int, max_iterations: int) -> _Program:
    """Build the program for problems of one shape."""
    cs = load_casadi()
    shapes = [
        (6,), (2,), (2,), (2,), (steps, 2), (steps,), (obstacles, steps, 2), (obstacles, steps, 3),
        (peers, steps, 2), (peers, steps), (points, 2), (points,), (points, points),
    ]  # fmt: skip
    sizes = [math.prod(shape) for shape in shapes]
    parameters = cs.MX.sym("p", sum(sizes))
    cuts = np.concatenate([[0], np.cumsum(sizes)])
    parts = [_Field(parameters[int(a) : int(b)], s) for a, b, s in zip(cuts, cuts[1:], shapes, strict=False)]
    scalars, position, velocity, goal, centre, radius, mean, covariance = parts[:8]
    peer_mean, peer_distance, sigma, weights, others = parts[8:]
    period, safe, margin, variance, gamma, reach = (scalars[i] for i in range(6))

    controls = cs.MX.sym("u", 2 * steps)
    places, speeds = [], []
    px, py, vx, vy = position[0], position[1], velocity[0], velocity[1]
    for s in range(steps):
        places.append((px, py))
        speeds.append((vx, vy))
        px, py = px + period * vx, py + period * vy
        vx, vy = vx + period * controls[2 * s], vy + period * controls[2 * s + 1]

    def distance(x: Any, y: Any, other_x: Any, other_y: Any) -> Any:
        return cs.sqrt((x - other_x) ** 2 + (y - other_y) ** 2 + 1e-18)

    physical = [x**2 + y**2 for x, y in speeds[1:]]
    physical += [controls[2 * s] ** 2 + controls[2 * s + 1] ** 2 for s in range(steps)]
    coupled = [distance(*places[s], centre[s, 0], centre[s, 1]) - radius[s] for s in range(2, steps)]
    for k in range(obstacles):
        for s in range(2, steps):
            d = distance(*places[s], mean[k, s, 0], mean[k, s, 1])
            nx, ny = (places[s][0] - mean[k, s, 0]) / d, (places[s][1] - mean[k, s, 1]) / d
            cxx, cxy, cyy = (covariance[k, s, i] for i in range(3))
            sigma_4 = cs.sqrt(nx * nx * cxx + 2 * nx * ny * cxy + ny * ny * cyy + 1e-18)
            coupled.append(safe - d + margin * sigma_4)
    for i in range(peers):
        for s in range(2, steps):
            coupled.append(peer_distance[i, s] - distance(*places[s], peer_mean[i, s, 0], peer_mean[i, s, 1]))

    excess: list[Any] = []
    if objective == REACH_GOAL:
        smooth = sum((x - goal[0]) ** 2 + (y - goal[1]) ** 2 for x, y in places)
    elif obstacles == 0:
        smooth = cs.MX(0)
    else:
        assert objective == INFORM
        ranges = [distance(*places[-1], sigma[i, 0], sigma[i, 1]) for i in range(points)]
        smooth = cs.MX(0)
        for i in range(points):
            exponents = [-((ranges[i] - ranges[j]) ** 2) / (2 * variance) - others[i, j] for j in range(points)]
            density = sum(weights[j] * cs.exp(exponents[j]) for j in range(points))
            # A point without weight counts nothing; its log would be of zero when all others are far.
            smooth += cs.if_else(weights[i] > 0, weights[i] * cs.log(cs.fmax(density, 1e-300)), 0)
        excess = [distance(*places[s], mean[0, s, 0], mean[0, s, 1]) - reach for s in range(steps)]

    options = {**_OPTIONS, "ipopt.max_iter": max_iterations}
    beyond = cs.MX.sym("t", len(excess))
    rows = [*physical, *coupled, *(each - beyond[s] for s, each in enumerate(excess))]
    total = smooth + gamma * cs.sum1(beyond) if excess else smooth
    variables = cs.vertcat(controls, beyond)
    optimise = cs.nlpsol(
        "optimise", "ipopt", {"x": variables, "p": parameters, "f": total, "g": cs.vertcat(*rows)}, options
    )
    missed = cs.MX.sym("e", len(coupled))
    rows = [*physical, *(each - missed[i] for i, each in enumerate(coupled))]
    variables = cs.vertcat(controls, missed)
    restore = cs.nlpsol(
        "restore",
        "ipopt",
        {"x": variables, "p": parameters, "f": cs.sumsqr(missed), "g": cs.vertcat(*rows)},
        options,
    )
    value = smooth + gamma * sum((cs.fmax(0, each) for each in excess), start=cs.MX(0))
    exact = cs.Function("objective", [controls, parameters], [value])
    return _Program(optimise, restore, len(coupled), len(excess), exact)


class _Field:
    """A slice of the parameter vector, indexed like the array it came from."""

    def __init__(self, vector: Any, shape: tuple[int, ...]) -> None:
        self._vector = vector
        self._shape = shape

    def __getitem__(self, index: Any) -> Any:
        return self._vector[int(np.ravel_multi_index(index if isinstance(index, tuple) else (index,), self._shape))]
