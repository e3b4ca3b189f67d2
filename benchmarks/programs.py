"""The horizon problem as programs for CasADi's IPOPT and fatrop and for SciPy's SLSQP, each in its best form.

All are given in closed form with exact first derivatives, the interior-point methods with exact second ones, too.
f6's max(0, d - Dmax) is a variable t >= 0 with t >= d - Dmax a step.  IPOPT and fatrop have the states as variables and
the dynamics as constraints (on these problems IPOPT is slower without); SLSQP, which is dense, has the controls alone.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as cs
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from epicycle.actors.robotics.numerics import definitions
from epicycle.actors.robotics.numerics.horizon import INFORM, HorizonProblem, trajectory

Array = NDArray[np.float64]
Solve = Callable[[HorizonProblem, Array, Array], Array]
GAP = 1e-5  # tolerance asked of all
FREE = 1e6  # m, a tube that does not bind
FIELDS = (
    "position", "velocity", "goal", "tube_centre", "tube_radius", "obstacle_mean", "obstacle_covariance", "peer_mean",
    "peer_distance", "sigma_positions", "sigma_weights", "others_distance",
)  # fmt: skip
SCALARS = (
    "period", "max_speed", "max_acceleration", "safe_distance", "margin", "measurement_variance", "range_penalty",
    "measurement_range",
)  # fmt: skip
IPOPT = {"ipopt.print_level": 0, "ipopt.sb": "yes", "ipopt.tol": GAP, "ipopt.mu_init": 1e-2}
FATROP = {"fatrop.print_level": 0, "fatrop.tol": GAP, "fatrop.mu_init": 1e-2, "structure_detection": "auto"}


@dataclass(frozen=True)
class Symbols:
    """A problem of one shape in symbols; ``numbers`` are the parameters in the order of ``numbers_of``."""

    numbers: Any
    value: dict[str, Any]
    bounds: Any  # what f3-f5 may be at most, (rows, N)


def numbers_of(problem: HorizonProblem, bounds: Array) -> Array:
    """The parameters of a program."""
    fields = [np.minimum(np.ravel(getattr(problem, name)), FREE) for name in FIELDS]
    scalars = [float(getattr(problem, name)) for name in SCALARS]
    return np.concatenate([scalars, *fields, bounds.ravel()])


def shape_of(problem: HorizonProblem) -> tuple[int, ...]:
    """The shape that distinguishes programs."""
    steps, points = len(problem.tube_radius), len(problem.sigma_weights)
    return steps, len(problem.obstacle_mean), len(problem.peer_mean), points, problem.objective


def symbols(steps: int, obstacles: int, peers: int, points: int) -> Symbols:
    """Parameters in symbols."""
    shapes = [
        (2,), (2,), (2,), (steps, 2), (steps,), (obstacles, steps, 2), (obstacles, steps, 3), (peers, steps, 2),
        (peers, steps), (points, 2), (points,), (points, points), (1 + obstacles + peers, steps),
    ]  # fmt: skip
    sizes = [int(np.prod(shape)) for shape in shapes]
    numbers = cs.SX.sym("p", len(SCALARS) + sum(sizes))
    value: dict[str, Any] = {name: numbers[i] for i, name in enumerate(SCALARS)}
    first = len(SCALARS)
    for name, shape, size in zip((*FIELDS, "bounds"), shapes, sizes, strict=True):
        parts = np.empty(size, dtype=object)
        parts[:] = [numbers[first + i] for i in range(size)]
        value[name] = parts.reshape(shape)
        first += size
    return Symbols(numbers, value, value.pop("bounds"))


def away(x: Any, y: Any, there: Any) -> Any:
    """Distance to a point."""
    return cs.sqrt((x - there[0]) ** 2 + (y - there[1]) ** 2 + 1e-18)


def constraints(known: Symbols, s: int, x: Any, y: Any) -> list[Any]:
    """f3-f5 at a step, each less its bound."""
    if s < 2:
        return []
    value = known.value
    rows = [away(x, y, value["tube_centre"][s]) - value["tube_radius"][s]]
    for mean, (xx, xy, yy) in zip(value["obstacle_mean"][:, s], value["obstacle_covariance"][:, s], strict=True):
        d = away(x, y, mean)
        nx, ny = (x - mean[0]) / d, (y - mean[1]) / d
        deviation = cs.sqrt(nx * nx * xx + 2 * nx * ny * xy + ny * ny * yy + 1e-18)
        rows.append(value["safe_distance"] - d + value["margin"] * deviation)
    for mean, keep in zip(value["peer_mean"][:, s], value["peer_distance"][:, s], strict=True):
        rows.append(keep - away(x, y, mean))
    return [row - known.bounds[i, s] for i, row in enumerate(rows)]


def cost(known: Symbols, objective: int, s: int, steps: int, x: Any, y: Any) -> tuple[Any, Any]:
    """What a step costs apart from f6, and the inside of f6's maximum (None where there is none)."""
    value = known.value
    if objective != INFORM:
        return (x - value["goal"][0]) ** 2 + (y - value["goal"][1]) ** 2, None
    if not len(value["obstacle_mean"]):
        return cs.SX(0), None
    informed = cs.SX(0)
    if s == steps - 1:
        count, weights = len(value["sigma_weights"]), value["sigma_weights"]
        r = [away(x, y, value["sigma_positions"][i]) for i in range(count)]
        for i in range(1, count):  # the centre has no weight
            exponents = [-((r[i] - r[j]) ** 2) / (2 * value["measurement_variance"]) for j in range(count)]
            density = sum(weights[j] * cs.exp(exponents[j] - value["others_distance"][i, j]) for j in range(1, count))
            informed += weights[i] * cs.log(density)
    return informed, away(x, y, value["obstacle_mean"][0, s]) - value["measurement_range"]


# --- interior-point methods: states and controls, stage after stage -----------------------------------


@functools.lru_cache
def staged(solver: str, steps: int, obstacles: int, peers: int, points: int, objective: int) -> Any:
    """A CasADi program with the structure that fatrop needs, and which of its constraints are equalities."""
    known = symbols(steps, obstacles, peers, points)
    value, period = known.value, known.value["period"]
    states = [cs.SX.sym(f"x{s}", 4) for s in range(steps)]
    ranged = objective == INFORM and obstacles > 0
    inputs = [cs.SX.sym(f"u{s}", 2 + ranged) for s in range(steps)]
    variables, rows, equal, total = [], [], [], cs.SX(0)
    for s in range(steps):
        x, u = states[s], inputs[s]
        variables += [x, u]
        if s + 1 < steps:
            driven = cs.vertcat(x[0] + period * x[2], x[1] + period * x[3], x[2] + period * u[0], x[3] + period * u[1])
            rows.append(states[s + 1] - driven)
            equal += [True] * 4
        if s == 0:
            rows.append(x - cs.vertcat(*value["position"], *value["velocity"]))
            equal += [True] * 4
        inside = [u[0] ** 2 + u[1] ** 2 - value["max_acceleration"] ** 2, *constraints(known, s, x[0], x[1])]
        if s > 0:
            inside.append(x[2] ** 2 + x[3] ** 2 - value["max_speed"] ** 2)
        here, excess = cost(known, objective, s, steps, x[0], x[1])
        total += here
        if ranged:
            inside += [excess - u[2], -u[2]]
            total += value["range_penalty"] * u[2]
        rows.append(cs.vertcat(*inside))
        equal += [False] * len(inside)
    program = {"x": cs.vertcat(*variables), "p": known.numbers, "f": total, "g": cs.vertcat(*rows)}
    options = {
        **(IPOPT if solver == "ipopt" else {**FATROP, "equality": equal}),
        "print_time": False,
        "error_on_fail": False,
    }
    return cs.nlpsol("solve", solver, program, options), np.where(equal, 0.0, -np.inf)


def solve_staged(solver: str, problem: HorizonProblem, start: Array, bounds: Array) -> Array:
    """The controls that IPOPT or fatrop finds from a start."""
    program, lower = staged(solver, *shape_of(problem))
    steps, ranged = len(start), problem.objective == INFORM and len(problem.obstacle_mean) > 0
    first = np.empty((steps, 6 + ranged))
    first[:, :2] = trajectory(problem.position, problem.velocity, start, problem.period, steps)
    first[:, 2:4] = problem.velocity
    first[1:, 2:4] += problem.period * np.cumsum(start[:-1], axis=0)
    first[:, 4:6] = start
    if ranged:
        first[:, 6] = 1e-3 + np.maximum(
            np.hypot(*(first[:, :2] - problem.obstacle_mean[0]).T) - problem.measurement_range, 0.0
        )
    found = program(x0=first.ravel(), p=numbers_of(problem, bounds), lbg=lower, ubg=0.0)
    return np.array(found["x"]).reshape(steps, 6 + ranged)[:, 4:6]


# --- SLSQP: controls alone -----------------------------------------------------------------------------


@functools.lru_cache
def condensed(steps: int, obstacles: int, peers: int, points: int, objective: int) -> tuple[Any, Any]:
    """Functions (variables, numbers) -> objective and its gradient, constraints (>= 0) and their Jacobian."""
    known = symbols(steps, obstacles, peers, points)
    value, period = known.value, known.value["period"]
    ranged = objective == INFORM and obstacles > 0
    variables = cs.SX.sym("u", (2 + ranged) * steps)
    u = cs.reshape(variables, 2 + ranged, steps)
    x, v = cs.vertcat(*value["position"]), cs.vertcat(*value["velocity"])
    total, rows = cs.SX(0), []
    for s in range(steps):
        rows += [cs.sumsqr(u[:2, s]) - value["max_acceleration"] ** 2, *constraints(known, s, x[0], x[1])]
        if s > 0:
            rows.append(cs.sumsqr(v) - value["max_speed"] ** 2)
        here, excess = cost(known, objective, s, steps, x[0], x[1])
        total += here
        if ranged:
            rows += [excess - u[2, s], -u[2, s]]
            total += value["range_penalty"] * u[2, s]
        x, v = x + period * v, v + period * u[:2, s]
    margin = -cs.vertcat(*rows)
    goal = cs.Function("goal", [variables, known.numbers], [total, cs.densify(cs.gradient(total, variables))])
    limit = cs.Function("limit", [variables, known.numbers], [margin, cs.densify(cs.jacobian(margin, variables))])
    return goal, limit


def solve_slsqp(problem: HorizonProblem, start: Array, bounds: Array) -> Array:
    """The controls that SLSQP finds from a start."""
    goal, limit = condensed(*shape_of(problem))
    numbers = numbers_of(problem, bounds)
    first = start
    if problem.objective == INFORM and len(problem.obstacle_mean):
        places = trajectory(problem.position, problem.velocity, start, problem.period, len(start))
        excess = np.hypot(*(places - problem.obstacle_mean[0]).T) - problem.measurement_range
        first = np.column_stack([start, np.maximum(excess, 0.0)])

    def price(u: Array) -> tuple[float, Array]:
        value, gradient = goal(u, numbers)
        return float(value), np.array(gradient).ravel()

    kept = {
        "type": "ineq",
        "fun": lambda u: np.array(limit(u, numbers)[0]).ravel(),
        "jac": lambda u: np.array(limit(u, numbers)[1]),
    }
    found = minimize(
        price, first.ravel(), jac=True, constraints=[kept], method="SLSQP", options={"ftol": GAP, "maxiter": 200}
    )
    return found.x.reshape(len(start), -1)[:, :2]


PEERS: dict[str, Solve] = {
    "CasADi IPOPT": functools.partial(solve_staged, "ipopt"),
    "CasADi fatrop": functools.partial(solve_staged, "fatrop"),
    "SciPy SLSQP": solve_slsqp,
}


# --- the value of a plan ------------------------------------------------------------------------------


def violations(problem: HorizonProblem, controls: Array) -> Array:
    """f3-f5 of a plan, a row each, from their definitions."""
    places = trajectory(problem.position, problem.velocity, controls, problem.period, len(controls))
    found: Array = definitions.constraints(problem, places)
    return found


def bounds_of(problem: HorizonProblem, controls: Array, slack: float = 1e-4) -> Array:
    """The permitted violation of f3-f5 by a peer: none where they can be kept, else that of the least violating plan.

    ``slack`` is what ours allows itself beyond that; with much less, fatrop loops for ever.
    """
    found = violations(problem, controls)
    return np.pad(np.where(found > 1e-6, found + slack, 0.0), ((0, 0), (2, 0)))  # steps 1 and 2 are decided before


def worth(problem: HorizonProblem, controls: Array, bounds: Array) -> tuple[float, float]:
    """The objective, from its definition, and how far the plan is beyond its bounds, f1 and f2 included (in m)."""
    steps = len(controls)
    places = trajectory(problem.position, problem.velocity, controls, problem.period, steps)
    speeds = problem.velocity + problem.period * np.cumsum(controls, axis=0)[:-1]
    beyond = max(
        float((violations(problem, controls) - bounds[:, 2:]).max()),
        float(np.hypot(*speeds.T).max()) - problem.max_speed,
        float(np.hypot(*controls.T).max()) - problem.max_acceleration,
    )
    if problem.objective != INFORM:
        return float(((places - problem.goal) ** 2).sum()), beyond
    if not len(problem.obstacle_mean):
        return 0.0, beyond
    ranges = np.hypot(*(places[-1] - problem.sigma_positions).T)
    exponents = (ranges[:, np.newaxis] - ranges) ** 2 / (2.0 * problem.measurement_variance) + problem.others_distance
    density = np.exp(-exponents) @ problem.sigma_weights
    excess = np.hypot(*(places - problem.obstacle_mean[0]).T) - problem.measurement_range
    informed = float((problem.sigma_weights * np.log(density))[problem.sigma_weights > 0.0].sum())
    return informed + problem.range_penalty * float(np.maximum(excess, 0.0).sum()), beyond
