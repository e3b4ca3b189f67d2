"""What solves the horizon problem: interchangeable behind one method."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
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
    """The paper's choice: an interior-point barrier method with Newton steps, compiled."""

    @cached_property
    def _solve(self) -> Callable[[HorizonProblem, Array], Solution]:
        from .numerics.barrier import solve

        return solve

    def solve(self, problem: HorizonProblem, starts: Array) -> Solution:
        return self._solve(problem, starts)


class Casadi(Solver):
    """CasADi's IPOPT on the same problem, warm-started: some 100 times slower, an independent check.

    It comes with ``pip install 'epicycle[casadi]'``.
    """

    max_iterations = Parameter(int, 500, min=1, doc="IPOPT iterations before the best point found so far is taken")

    def prepare(self) -> None:
        from .casadi_solver import load_casadi

        load_casadi()

    def solve(self, problem: HorizonProblem, starts: Array) -> Solution:
        from .casadi_solver import solve

        return solve(problem, starts, self.max_iterations)
