"""What a robot wants: the objectives of eqs. (2) and (5)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..core import Configurable, Parameter, array_parameter
from .messages import Array

if TYPE_CHECKING:
    from .numerics.horizon import HorizonProblem


NAT, BIT = "nat", "bit"
LN2 = 0.6931471805599453


class Objective(Configurable):
    """Base of the objectives: fills in the objective's fields of a horizon problem."""

    def pose(self, problem: HorizonProblem, points: Array, weights: Array) -> HorizonProblem:
        """The problem with this objective.

        ``points`` (M, 2) and ``weights`` (M,) are the target's sigma points at the end of the horizon (M = 0
        while no target is known).
        """
        raise NotImplementedError


class ReachGoal(Objective):
    """Eq. (2): the sum of the squared distances to a goal over the horizon."""

    goal = array_parameter((2,), (0.0, 0.0), unit="m", doc="where to go")

    def pose(self, problem: HorizonProblem, points: Array, weights: Array) -> HorizonProblem:
        return problem.to_reach(self.goal)


class Inform(Objective):
    """Eq. (5): what range measurements at the end of the horizon tell, less a penalty for distance."""

    range = Parameter(float, 30.0, unit="m", min=0, doc="Dmax: farther from the target than this is penalised")
    penalty = Parameter(float, 0.001, min=0, doc="gamma: the penalty for each metre too far, at each step")
    variance = Parameter(float, 2.0, unit="m^2", above=0, doc="eta: variance of the predicted ranges")
    unit = Parameter(str, NAT, choices=(NAT, BIT), doc="of the information, against which the penalty counts")
    joint = Parameter(bool, True, doc="count what all robots measure together; false: what this one measures")

    def pose(self, problem: HorizonProblem, points: Array, weights: Array) -> HorizonProblem:
        others = problem.peer_mean if self.joint else problem.peer_mean[:0]
        # In bits the information is more by 1 / log 2; the penalty by its inverse less has the same optimum.
        penalty = self.penalty * (LN2 if self.unit == BIT else 1.0)
        return problem.to_inform(points, weights, others, self.variance, penalty, self.range)
