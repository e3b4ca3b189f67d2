"""A horizon problem as a nonlinear program for CasADi; loaded only when requested.

The program is the problem's own methods on symbols: ``numerics.definitions``, its ``Dynamics`` and its ``Objective``.
They are independent of the barrier method's code, so that the two can check each other.  A ``positive`` part is exact:
each max(0, x) is a variable t with t >= 0 and t >= x.

An infeasible problem is solved in two stages, as the barrier method does: the sum of the squared violations
of the constraints is minimised first; then the cost, with each constraint bounded by its own least violation.

A robot whose state is beyond its limits, after a disturbance or a gust, has no plan that keeps them: it then keeps to
what braking makes of them.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from typing import Any, NamedTuple

import numpy as np

from ..core import EpicycleError, brief
from .arrays import Array
from .numerics.horizon import TOLERANCE, Solution
from .problem import FAR, Problem

_SLACK = 1e-4  # m; added to the second stage's bounds, so that they have an interior
_STRICT = 1e-6  # by which limits are kept, as the solver keeps its bounds up to a tolerance
_KEPT = 64  # programs
_OPTIONS: dict[str, dict[str, Any]] = {
    "ipopt": {
        "ipopt.print_level": 0,
        "ipopt.sb": "yes",
        "ipopt.tol": 1e-9,
        "ipopt.bound_relax_factor": 0.0,
        "ipopt.mu_init": 1e-2,
    },
    "fatrop": {"fatrop.print_level": 0, "fatrop.tol": 1e-8, "fatrop.mu_init": 1e-2},
}


_WRITTEN_FOR_BOTH = (
    "take functions of a state, a control or a trajectory from epicycle.actors.symbolic, not from math, and write no "
    "condition on them"
)


class SolverError(EpicycleError):
    """A solver is not installed, or cannot use what it is given."""


def load_casadi(plugin: str = "ipopt") -> Any:
    """The casadi module, or an error that says how to get it or what it lacks."""
    try:
        import casadi
    except ImportError:
        raise SolverError(
            "the solver 'Casadi' needs a package that is not installed: pip install 'epicycle[casadi]'"
        ) from None
    if not casadi.has_nlpsol(plugin):
        raise SolverError(f"the installed CasADi has no {plugin!r}; leave 'method' out")
    return casadi


def solve(problem: Problem, starts: Array, max_iterations: int = 500, method: str = "ipopt") -> Solution:
    """Solve from ``starts[0]`` (k, N, m); never raises."""
    attempt = _Attempt(problem, starts.shape[1:], max_iterations, method)
    candidates = [start for start in starts if attempt.keeps_limits(start)]
    if not candidates:
        attempt.allow(starts[-1])
        candidates = [start for start in starts[-1:] if attempt.keeps_limits(start)]
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
    return attempt.problem.solution(controls, attempt.iterations)


def _prepared(problem: Problem) -> Problem:
    """The problem without numbers that a solver cannot use: infinite ones, and points of weight 0."""
    heavy = problem.weights > 0.0
    return problem._replace(
        samples=problem.samples[np.resize(heavy, len(problem.samples))],
        weights=problem.weights[heavy],
        tube_radius=np.where(np.isfinite(problem.tube_radius), problem.tube_radius, FAR),
        lowest=max(problem.lowest, -FAR),
        highest=min(problem.highest, FAR),
    )


class _Attempt:
    """One problem: its numbers, its two programs, and how many iterations they have taken."""

    def __init__(self, problem: Problem, shape: tuple[int, ...], max_iterations: int, method: str) -> None:
        self.problem = _prepared(problem)
        self._parameters = np.concatenate([np.ravel(each) for each in self.problem.arrays])
        self._programs = _programs(self.problem, shape, max_iterations, method)
        self._allowed = np.zeros(self._programs.limits)
        self.iterations = 0

    def violations(self, controls: Array) -> Array:
        """The constraints in the order of the program's rows."""
        found: Array = self.problem.constraints(controls)
        return found

    def worst(self, controls: Array) -> float:
        """The largest violation, m."""
        return max(0.0, float(np.max(self.violations(controls), initial=0.0)))

    def allow(self, braking: Array) -> None:
        """Let plans break the limits as far as ``braking`` does."""
        beyond = self.problem.limits(braking)
        self._allowed = np.where(beyond > 0.0, beyond + _SLACK, 0.0)

    def keeps_limits(self, controls: Array) -> bool:
        """Whether the robot can do it."""
        return bool((self.problem.limits(controls) <= self._allowed).all())

    def optimise(self, start: Array, bounds: Any) -> Array | None:
        """Minimise the cost with the constraints at most ``bounds``; None without a usable result."""
        beyond = np.array(self._programs.beyond(start.ravel(), self._parameters)).ravel()
        return self._run(self._programs.optimise, start, np.maximum(beyond, 0.0) + 1e-3, bounds)

    def restore(self, start: Array) -> Array | None:
        """Minimise the sum of the squared violations; None without a usable result."""
        return self._run(self._programs.restore, start, np.maximum(self.violations(start), 0.0) + 1e-2, 0.0)

    def _run(self, program: Any, start: Array, extra: Array, bounds: Any) -> Array | None:
        """Solve from the controls ``start`` and ``extra`` non-negative variables."""
        upper, limits = np.zeros(program.size1_out("g")), self._programs.limits
        upper[:limits] = self._allowed - _STRICT
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
    """Both stages of problems of one shape.  Their rows are the limits, the constraints, and what is positive."""

    optimise: Any  # variables: the controls, then the positive parts
    restore: Any  # variables: the controls, then the violation of each constraint
    beyond: Any  # what the positive parts are of
    limits: int  # rows
    coupled: int  # rows of the constraints


_made: OrderedDict[Any, _Programs] = OrderedDict()  # the latest last


def _programs(problem: Problem, shape: tuple[int, ...], max_iterations: int, method: str) -> _Programs:
    """The programs of a problem, which differ only in shapes and in what is not a number."""
    key = problem.key, shape, tuple(map(np.shape, problem.arrays)), max_iterations, method
    if key in _made:
        _made.move_to_end(key)
    else:
        _made[key] = _new_programs(problem, shape, max_iterations, method)
        if len(_made) > _KEPT:
            _made.popitem(last=False)
    return _made[key]


def _has_nan(cs: Any, made: Any) -> bool:
    """Whether symbols were lost on the way: the functions of ``math`` make NaN of them."""
    function = cs.Function("made", [cs.vertcat(*cs.symvar(made))], [made])
    steps = range(function.n_instructions())
    return any(math.isnan(function.instruction_constant(k)) for k in steps if function.instruction_id(k) == cs.OP_CONST)


def _new_programs(problem: Problem, shape: tuple[int, ...], max_iterations: int, method: str) -> _Programs:
    cs = load_casadi(method)
    found: list[Any] = []  # what positive parts are of, and these
    options = {"print_time": False, "error_on_fail": False, f"{method}.max_iter": max_iterations, **_OPTIONS[method]}

    def symbols(*shape: int) -> Any:
        each = [cs.SX.sym("x") for _ in range(math.prod(shape))]
        return np.array(each, dtype=object).reshape(shape)

    def positive(values: Any) -> Any:
        within = np.asarray(values, dtype=object)
        found.append((within.ravel(), parts := symbols(*within.shape)))
        return parts if within.shape else parts.item()

    # NumPy would treat a single symbol as an argument of a function.
    numbers = [symbols(*(np.shape(each) or (1,))) for each in problem.arrays]
    posed, controls = problem.of(numbers), symbols(*shape)
    parameters = cs.vertcat(*[each for array in numbers for each in array.ravel()])
    try:
        limits, coupled = posed.limits(controls).ravel(), posed.constraints(controls)
        cost = posed.cost(controls, positive)
    except NotImplementedError:  # a method that is missing
        raise
    except RuntimeError as error:  # CasADi's own
        told = SolverError(f"a symbol cannot be used so, {str(error).rpartition(': ')[2]!r}: {_WRITTEN_FOR_BOTH}")
        raise told.with_traceback(error.__traceback__) from None
    within = [each for values, _ in found for each in values]
    parts = [each for _, made in found for each in np.ravel(made)]
    try:
        cost = cs.SX(cost)
    except NotImplementedError:
        raise SolverError(f"{type(problem.objective).__name__}.cost gave {brief(cost)}; expected a number") from None
    for part, made in ((problem.dynamics, [*limits, *coupled]), (problem.objective, [cost, *within])):
        if _has_nan(cs, cs.vertcat(*made)):
            raise SolverError(f"{type(part).__name__} gave NaN for symbols: {_WRITTEN_FOR_BOTH}")

    def program(cost: Any, extra: list[Any], rows: list[Any]) -> Any:
        posed = {
            "x": cs.vertcat(*controls.ravel(), *extra),
            "p": parameters,
            "f": cost,
            "g": cs.vertcat(*limits, *rows),
        }
        return cs.nlpsol("program", method, posed, options)

    missed = symbols(len(coupled))
    excess = [value - part for value, part in zip(within, parts, strict=True)]
    return _Programs(
        program(cost, parts, [*coupled, *excess]),
        program((missed * missed).sum(), [*missed], [*(coupled - missed)]),
        cs.Function("beyond", [cs.vertcat(*controls.ravel()), parameters], [cs.vertcat(*within)]),
        len(limits),
        len(coupled),
    )
