"""The horizon problem as a nonlinear program for CasADi and IPOPT; loaded only when requested.

The program is ``numerics.definitions`` on symbols, independent of the barrier method's code, so that the two can check
each other.  f6 is exact: each max(0, d - Dmax) is a variable t with t >= 0 and t >= d - Dmax.

An infeasible problem is solved in two stages, as the barrier method does: the sum of the squared violations
of f3-f5 is minimised first; then the objective, with each constraint bounded by its own least violation.
"""

from __future__ import annotations

import functools
import math
from typing import Any, NamedTuple

import numpy as np

from ..core import EpicycleError
from .arrays import Array
from .numerics import definitions
from .numerics.barrier import TOLERANCE, Solution
from .numerics.horizon import REACH_GOAL, HorizonProblem

_SLACK = 1e-4  # m; added to the second stage's bounds, so that they have an interior
_STRICT = 1.0 - 1e-7  # f1 and f2 are a little stricter than IPOPT's tolerance
_FAR = 1e6  # m; a tube without bound would be inf - inf to IPOPT; this one is out of reach
_NUMBERS = [name for name in HorizonProblem._fields if name != "objective"]  # a program's parameters
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
    """A solver is not installed."""


def load_casadi() -> Any:
    """The casadi module, or an error that says how to get it."""
    try:
        import casadi
    except ImportError:
        raise SolverError(
            "the solver 'Casadi' needs a package that is not installed: pip install 'epicycle[casadi]'"
        ) from None
    return casadi


def solve(problem: HorizonProblem, starts: Array, max_iterations: int = 500) -> Solution:
    """Solve from ``starts[0]`` (k, N, d); never raises."""
    attempt = _Attempt(problem, starts.shape[1], max_iterations)
    candidates = [start for start in starts if attempt.keeps_limits(start)]
    start = candidates[0] if candidates else np.zeros(starts.shape[1:])
    controls = attempt.optimise(start, 0.0)
    if controls is None or attempt.worst(controls) > TOLERANCE:
        restored = attempt.restore(start)
        if restored is not None:
            candidates.append(restored)
            left = attempt.violations(restored)
            better = attempt.optimise(restored, np.where(left > -_SLACK, np.maximum(left, 0.0) + _SLACK, 0.0))
            if better is not None and attempt.worst(better) <= attempt.worst(restored) + 2.0 * _SLACK:
                restored = better
                candidates.insert(0, better)
            if controls is None or attempt.worst(restored) < attempt.worst(controls):
                controls = restored
    if controls is None:
        controls = min(candidates, key=attempt.worst) if candidates else start
    worst = attempt.worst(controls)
    value = float(definitions.objective(attempt.problem, definitions.driven(problem, controls)[0]))
    return Solution(controls, worst if worst > TOLERANCE else 0.0, value, attempt.iterations)


def _limits(problem: HorizonProblem, controls: Any, share: float) -> tuple[Any, Any]:
    """f1 of all speeds but the first, which is decided already, and f2, with ``share`` of what they allow."""
    velocities = definitions.driven(problem, controls)[1][1:]
    return (
        definitions.f1(velocities, share * problem.max_speed, share * problem.climb_speed),
        definitions.f2(controls, share * problem.max_acceleration, share * problem.climb_acceleration),
    )


class _Attempt:
    """One problem: its numbers, its two programs, and how many iterations they have taken."""

    def __init__(self, problem: HorizonProblem, steps: int, max_iterations: int) -> None:
        heavy = problem.sigma_weights > 0.0  # a point with weight 0 has no effect, and no logarithm
        rows = np.resize(heavy, len(problem.sigma_positions))
        self.problem = problem._replace(
            tube_radius=np.where(np.isfinite(problem.tube_radius), problem.tube_radius, _FAR),
            climb_speed=min(problem.climb_speed, _FAR),
            climb_acceleration=min(problem.climb_acceleration, _FAR),
            lowest=max(problem.lowest, -_FAR),
            highest=min(problem.highest, _FAR),
            sigma_positions=problem.sigma_positions[rows],
            sigma_weights=problem.sigma_weights[heavy],
            others_distance=problem.others_distance[np.ix_(rows, heavy)] if heavy.any() else np.empty((0, 0)),
        )
        numbers = [getattr(self.problem, name) for name in _NUMBERS]
        self._parameters = np.concatenate([np.ravel(each) for each in numbers])
        self._programs = _programs(steps, tuple(map(np.shape, numbers)), problem.objective, max_iterations)
        self.iterations = 0

    def violations(self, controls: Array) -> Array:
        """f3-f5 in the order of the program's rows."""
        return definitions.violations(self.problem, controls).ravel()

    def worst(self, controls: Array) -> float:
        """The largest violation of f3-f5, m."""
        return max(0.0, float(self.violations(controls).max()))

    def keeps_limits(self, controls: Array) -> bool:
        """Whether f1 and f2 are kept; the speed at step 1 is decided already."""
        return all(bool((limit <= 0.0).all()) for limit in _limits(self.problem, controls, 1.0))

    def optimise(self, start: Array, bounds: Any) -> Array | None:
        """Minimise the objective with f3-f5 at most ``bounds``; None without a usable result."""
        beyond = np.empty(0)
        if self.problem.objective != REACH_GOAL:
            positions, reach = definitions.driven(self.problem, start)[0], self.problem.measurement_range
            beyond = definitions.f6(positions, definitions.targets(self.problem), reach) + 1e-3
        return self._run(self._programs.optimise, start, beyond.ravel(), bounds)

    def restore(self, start: Array) -> Array | None:
        """Minimise the sum of the squared violations of f3-f5; None without a usable result."""
        return self._run(self._programs.restore, start, np.maximum(self.violations(start), 0.0) + 1e-2, 0.0)

    def _run(self, program: Any, start: Array, extra: Array, bounds: Any) -> Array | None:
        """Solve from the controls ``start`` and ``extra`` non-negative variables."""
        upper, limits = np.zeros(program.size1_out("g")), 2 * len(start) - 1
        upper[limits : limits + self._programs.coupled] = bounds
        result = program(
            x0=np.concatenate([start.ravel(), extra]),
            p=self._parameters,
            lbx=np.concatenate([np.full(start.size, -math.inf), np.zeros(len(extra))]),
            lbg=-math.inf,
            ubg=upper,
        )
        self.iterations += int(program.stats()["iter_count"])
        controls = np.array(result["x"]).ravel()[: start.size].reshape(start.shape)
        return controls if np.isfinite(controls).all() and self.keeps_limits(controls) else None


class _Programs(NamedTuple):
    """Both stages of problems of one shape.  Their rows are f1 and f2, then f3-f5."""

    optimise: Any  # variables: the controls, then f6 at each step where it counts
    restore: Any  # variables: the controls, then the violation of each of f3-f5
    coupled: int  # rows of f3-f5


@functools.lru_cache(maxsize=64)
def _programs(steps: int, shapes: tuple[tuple[int, ...], ...], objective: int, max_iterations: int) -> _Programs:
    cs = load_casadi()

    def symbols(*shape: int) -> Any:
        each = [cs.SX.sym("x") for _ in range(math.prod(shape))]
        return np.array(each, dtype=object).reshape(shape)

    numbers = [
        symbols(*(shape or (1,))) for shape in shapes
    ]  # NumPy would treat a single symbol as an argument of a function
    problem = HorizonProblem(**dict(zip(_NUMBERS, numbers, strict=True)), objective=objective)
    parameters = cs.vertcat(*np.concatenate([np.ravel(each) for each in numbers]))
    controls = symbols(steps, *shapes[_NUMBERS.index("position")])
    positions, _ = definitions.driven(problem, controls)
    limits = [row for each in _limits(problem, controls, _STRICT) for row in each]
    coupled = definitions.constraints(problem, positions).ravel()

    def program(cost: Any, extra: Any, rows: list[Any]) -> Any:
        posed = {
            "x": cs.vertcat(*controls.ravel(), *extra),
            "p": parameters,
            "f": cs.SX(cost),
            "g": cs.vertcat(*limits, *rows),
        }
        return cs.nlpsol("program", "ipopt", posed, {**_OPTIONS, "ipopt.max_iter": max_iterations})

    beyond, excess = symbols(0), symbols(0)
    if objective != REACH_GOAL:
        watched = definitions.targets(problem)
        beyond = symbols(len(watched), steps)
        reached = [definitions.out_of_reach(positions, each, problem.measurement_range) for each in watched]
        excess = np.reshape(reached, beyond.shape) - beyond
    missed = symbols(len(coupled))
    return _Programs(
        program(definitions.objective(problem, positions, beyond), beyond.ravel(), [*coupled, *excess.ravel()]),
        program((missed * missed).sum(), missed, [*(coupled - missed)]),
        len(coupled),
    )
