"""Parts of a controller: objectives of the robot (eqs. (2) and (5)), and solvers of the horizon problem."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core import Configurable, MappingParameter, Parameter, ParameterError
from .arrays import Array
from .problem import Objective
from .receiving import PlaceParameter

if TYPE_CHECKING:
    from .dynamics import Dynamics
    from .numerics.horizon import HorizonProblem, Solution
    from .problem import Beliefs, Problem, Trajectory

NAT, BIT = "nat", "bit"
TARGET = "target"
LN2 = 0.6931471805599453


def in_space(place: Array, dimensions: int) -> Array:
    """A place (.., 2) or (.., 3), with a height of 0 added if it has none and there are three dimensions."""
    missing = dimensions - place.shape[-1]
    return np.concatenate((place, np.zeros((*place.shape[:-1], missing))), axis=-1) if missing > 0 else place


def _check_height(name: str, place: Array, dimensions: int) -> None:
    if len(place) > dimensions:
        raise ParameterError(f"{name} has a height, and the robot does not fly; expected 2 numbers")


class ReachGoal(Objective):
    """Eq. (2): the sum of the squared distances to a goal over the horizon.

    In space, a goal without a height is on the ground.
    """

    goal = PlaceParameter((0.0, 0.0), doc="where to go; with the height last for a robot that flies")

    def check_dimensions(self, dimensions: int) -> None:
        _check_height("'goal'", self.goal, dimensions)

    def cost(self, trajectory: Trajectory, beliefs: Beliefs) -> Any:
        from .numerics.definitions import f0

        return f0(trajectory.positions, in_space(self.goal, trajectory.positions.shape[1])).sum()

    def pose(self, problem: Problem) -> dict[str, Any]:
        return {"goal": in_space(self.goal, problem.dynamics.dimensions)[np.newaxis]}


class _Weights(MappingParameter):
    """Weights by name, all of them positive."""

    def __init__(self, *, doc: str) -> None:
        super().__init__(Parameter(float, above=0), doc=doc)

    def convert(self, value: object) -> dict[str, float]:
        weights: dict[str, float] = super().convert(value) or {}
        if not weights:
            raise ParameterError("it names nobody; expected at least one robot, or 'target'")
        return weights


class StayNear(Objective):
    """The sum over the horizon of the squared distances to others, each times its weight: eq. (2) with moving goals.

    This is eq. (2) with one goal that moves: their weighted mean.  Near two robots, the robot is a relay between them,
    in the middle if the weights are equal; near the target and a robot, it guards that robot; near one robot, it goes
    along.  The place of a robot is that of its latest plan, the place of the target that of the estimate.  Names of
    which nothing is known do not count; if nothing is known of any, the robot stays where it is.
    """

    to = _Weights(doc="weights by the names of robots, as in their plans, or 'target'")
    offset = PlaceParameter((0.0, 0.0), doc="where to be, as seen from that place")

    def check_dimensions(self, dimensions: int) -> None:
        _check_height("'offset'", self.offset, dimensions)

    def cost(self, trajectory: Trajectory, beliefs: Beliefs) -> Any:
        from .numerics.definitions import f0

        return f0(trajectory.positions, self._goal(trajectory.positions[0], beliefs)).sum()

    def pose(self, problem: Problem) -> dict[str, Any]:
        here = problem.state[: problem.dynamics.dimensions]
        return {"goal": np.atleast_2d(self._goal(here, problem.beliefs))}

    def _goal(self, here: Any, beliefs: Beliefs) -> Any:
        """Where to be, at each step (N, d) or always (d,)."""
        from .numerics.definitions import common_goal

        known = dict(zip((*beliefs.names, TARGET), (*beliefs.peers, *beliefs.targets[:1]), strict=False))
        near = [name for name in self.to if name in known]
        if not near:
            return here
        places, shares = np.stack([known[name] for name in near]), np.array([self.to[name] for name in near])
        return common_goal(places, shares) + in_space(self.offset, len(here))


class Inform(Objective):
    """Eq. (5): the information of range measurements at the end of the horizon, minus a penalty for distance.

    Of several targets it is the sum: they are independent, and each has its own measurements.
    """

    range = Parameter(float, 30.0, unit="m", min=0, doc="Dmax: distances from the target beyond this are penalised")
    penalty = Parameter(float, 0.001, min=0, doc="gamma: the penalty for each metre too far, at each step")
    variance = Parameter(float, 2.0, unit="m^2", above=0, doc="eta: variance of the predicted ranges")
    across = Parameter(
        float, None, unit="m^2", above=0, doc="variance of the predicted directions, as lengths (default: ranges alone)"
    )
    unit = Parameter(str, NAT, choices=(NAT, BIT), doc="unit of the information, relative to the penalty")
    joint = Parameter(
        bool, True, doc="whether to count what all robots measure together, or only what this one measures"
    )

    def cost(self, trajectory: Trajectory, beliefs: Beliefs) -> Any:
        from .numerics.definitions import f6, misfit, mutual_information

        ends, total = (beliefs.peers if self.joint else beliefs.peers[:0])[:, -1], 0.0
        heavy = np.array([not _is_zero(each) for each in beliefs.weights], dtype=bool)  # the others have no logarithm
        for points, target in zip(beliefs.samples_by_target, beliefs.targets, strict=False):
            points, weights = points[heavy], beliefs.weights[heavy]
            eta = self.variance, self.across
            others = misfit(points, ends, *eta) if len(ends) else np.zeros((len(points), len(points)))
            information = mutual_information(
                trajectory.positions[-1], points, weights, self.variance, others, self.across
            )
            too_far = f6(trajectory.positions, target, self.range, trajectory.positive)
            total = total - information + (self._gamma * too_far).sum()
        return total

    def pose(self, problem: Problem) -> dict[str, Any]:
        """With ``across``, what two points differ by across the line of sight is the rest of their distance, which no
        robot's place changes: it counts as a constant, and ranges by as much more as they say more."""
        (kind, exponents), beliefs = self._kernels, problem.beliefs
        others, variance, across = beliefs.peers if self.joint else beliefs.peers[:0], self.variance, self.across
        if across is not None:
            variance = math.inf if variance == across else 1.0 / (1.0 / variance - 1.0 / across)
        distances = []
        for points in beliefs.samples_by_target:
            distance = exponents(points, others, variance)
            if across is not None:
                robots, offsets = len(others) + 1, points[:, np.newaxis] - points
                for c in range(points.shape[1]):
                    distance = distance + robots * offsets[:, :, c] * offsets[:, :, c] / (2.0 * across)
            distances.append(distance)
        return {
            "objective": kind,
            "sigma_positions": beliefs.samples,
            "sigma_weights": beliefs.weights,
            "others_distance": distances[0] if len(distances) == 1 else np.concatenate(distances or [np.empty((0, 0))]),
            "measurement_variance": variance,
            "range_penalty": self._gamma,
            "measurement_range": self.range,
        }

    @cached_property
    def _kernels(self) -> tuple[int, Callable[..., Array]]:
        from .numerics import horizon, mutual_information

        return horizon.INFORM, mutual_information.pairwise_distance

    @property
    def _gamma(self) -> float:
        """The penalty beside an information in nats.

        In bits, the information is larger by a factor of 1 / log 2; a penalty smaller by that factor has the same
        optimum.
        """
        return self.penalty * (LN2 if self.unit == BIT else 1.0)


def _is_zero(weight: Any) -> bool:
    """Whether a weight is the number 0; a symbol is none."""
    return isinstance(weight, float) and weight == 0.0


KNOWN = ReachGoal, StayNear, Inform  # objectives that the compiled kernels know


class Solver(Configurable):
    """Finds a plan for a ``Problem``.

    It makes ``problem.cost(controls)`` small while all numbers of ``problem.limits(controls)`` and of
    ``problem.constraints(controls)`` are at most 0, and answers ``problem.solution(controls)``.
    """

    def prepare(self) -> None:
        """Called once before time starts: load what is slow to load, and report what is missing."""

    def refuses(self, dynamics: Dynamics, objective: Objective) -> str:
        """Why it cannot solve problems with these; empty if it can."""
        return ""

    def solve(self, problem: Problem, starts: Array) -> Solution:
        """The best plan found from ``starts`` (k, N, m), of which the last one brakes; never raises, and finite for
        finite input."""
        raise NotImplementedError


class Barrier(Solver):
    """The paper's choice: an interior-point barrier method with Newton steps, compiled.

    The paper leaves open how far it goes, over which controls, and what it does if no plan keeps every constraint.
    """

    gap = Parameter(float, 1e-5, unit="1", min=1e-9, max=1, doc="relative gap to the optimum at which it stops")
    last_parameter = Parameter(
        float,
        0.0,
        min=0,
        max=1e3,
        doc="barrier parameter at which it stops instead, in units of the objective; 0: by the gap",
    )
    free_controls = Parameter(
        int, 0, min=0, doc="number of free controls, the last of which is held to the end of the horizon; 0: all"
    )
    infeasible = Parameter(
        str,
        "progress",
        choices=("progress", "least_violation", "brake"),
        doc="answer to a problem that no plan solves: the plan of least violation that makes the most progress, the "
        "first one of least violation, or the hardest braking",
    )

    def refuses(self, dynamics: Dynamics, objective: Objective) -> str:
        from .dynamics import DoubleIntegrator

        if type(dynamics) is DoubleIntegrator and type(objective) in KNOWN:
            return ""
        names = ", ".join(each.__name__ for each in KNOWN)
        return (
            f"Barrier solves the objectives {names} for a DoubleIntegrator, and not {type(objective).__name__} for a "
            f"{type(dynamics).__name__}; write 'solver: {{type: Casadi}}'"
        )

    @cached_property
    def _kernels(self) -> tuple[Callable[[Problem], HorizonProblem], Callable[[HorizonProblem, Array], Solution]]:
        from .numerics import barrier, horizon

        answers = {"progress": barrier.PROGRESS, "least_violation": barrier.LEAST_VIOLATION, "brake": barrier.BRAKE}
        rules = barrier.Rules(self.gap, self.last_parameter, self.free_controls, answers[self.infeasible])
        return horizon.numbers_of, partial(barrier.solve, rules=rules)

    def solve(self, problem: Problem, starts: Array) -> Solution:
        numbers_of, solve = self._kernels
        return solve(numbers_of(problem), starts)


class Casadi(Solver):
    """CasADi's IPOPT, for any dynamics and any objective; on the paper's problem it is an independent check.

    It is thousands of times slower than ``Barrier``.

    It comes with ``pip install 'epicycle[casadi]'``.
    """

    method = Parameter(str, "ipopt", choices=("ipopt", "fatrop"), doc="which of CasADi's solvers; both come with it")
    max_iterations = Parameter(int, 500, min=1, doc="iterations after which the best point so far is taken")

    def prepare(self) -> None:
        from .casadi_solver import load_casadi

        load_casadi(self.method)

    def solve(self, problem: Problem, starts: Array) -> Solution:
        from .casadi_solver import solve

        return solve(problem, starts, self.max_iterations, self.method)
