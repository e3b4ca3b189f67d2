"""What solves the horizon problem: interchangeable behind one method."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial
from typing import TYPE_CHECKING

from ..core import Configurable, Parameter
from .messages import Array

if TYPE_CHECKING:
    from .numerics.barrier import Solution
    from .numerics.horizon import HorizonProblem


class Solver(Configurable):
    """Base of the solvers of the horizon problem."""

    def prepare(self) -> None:
        """Called once before time starts: load what is slow to load, complain about what is missing."""

    def solve(self, problem: HorizonProblem, starts: Array) -> Solution:
        """The best plan found from ``starts`` (k, N, 2); never raises, and finite for finite input."""
        raise NotImplementedError


class Barrier(Solver):
    """The paper's choice: an interior-point barrier method with Newton steps, compiled.

    How far it goes, over which controls, and what it does where no plan keeps every constraint, the paper leaves open.
    """

    gap = Parameter(float, 1e-5, unit="1", min=1e-9, max=1, doc="relative gap to the optimum at which it stops")
    last_parameter = Parameter(
        float,
        0.0,
        min=0,
        max=1e3,
        doc="the barrier parameter at which it stops instead, in units of the objective; 0: by the gap",
    )
    free_controls = Parameter(
        int, 0, min=0, doc="how many controls are free, the last of which is held to the end of the horizon; 0: all"
    )
    infeasible = Parameter(
        str,
        "progress",
        choices=("progress", "least_violation", "brake"),
        doc="what answers a problem that no plan solves: the plan of least violation that gets on best, the first one "
        "of least violation, or the hardest braking",
    )

    @cached_property
    def _solve(self) -> Callable[[HorizonProblem, Array], Solution]:
        from .numerics import barrier

        answers = {"progress": barrier.PROGRESS, "least_violation": barrier.LEAST_VIOLATION, "brake": barrier.BRAKE}
        rules = barrier.Rules(self.gap, self.last_parameter, self.free_controls, answers[self.infeasible])
        return partial(barrier.solve, rules=rules)

    def solve(self, problem: HorizonProblem, starts: Array) -> Solution:
        return self._solve(problem, starts)


class Casadi(Solver):
    """CasADi's IPOPT on the same problem, warm-started: thousands of times slower, an independent check.

    It comes with ``pip install 'epicycle[casadi]'``.
    """

    max_iterations = Parameter(int, 500, min=1, doc="IPOPT iterations before the best point found so far is taken")

    def prepare(self) -> None:
        from .casadi_solver import load_casadi

        load_casadi()

    def solve(self, problem: HorizonProblem, starts: Array) -> Solution:
        from .casadi_solver import solve

        return solve(problem, starts, self.max_iterations)
