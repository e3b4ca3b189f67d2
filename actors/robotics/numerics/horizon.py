"""The horizon problem of the paper's eqs. (2)-(5) as plain arrays, and the dynamics that links them.

Indices.  The problem is posed at time t.  The acceleration ``U_t`` was decided one period ago and is being
applied, so ``Pr_{t+1}`` and ``V_{t+1}`` are known; the unknowns are ``controls[j] = U_{t+1+j}``, j = 0..N-1.
Row ``s - 1`` of an array over the horizon belongs to the prediction step s = 1..N, that is time t + s * period.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from . import definitions
from .compiled import Array, Layers, Row, Table, inner
from .definitions import INFORM, REACH_GOAL, driven, f1, f2
from .mutual_information import pairwise_distance

TOLERANCE = 1e-6  # m; smaller violations count as none
FAR = 1e6  # m; a tube without bound would be inf - inf to some solvers; this one is out of reach


class Solution(NamedTuple):
    """The result of a solver: the plan and its quality."""

    controls: Array  # (N, m) U_{t+1} .. U_{t+N}
    violation: float  # largest violation of f3-f5, metres; 0 when feasible
    objective: float
    iterations: int  # Newton steps, or whatever the solver counts


def within_reach(values: Any) -> Any:
    """Constraints of which none is infinitely far from its bound."""
    return values if values.dtype == object else np.maximum(values, -FAR)


def solution(problem: Any, controls: Array, iterations: int) -> Solution:
    """A plan for a problem, with its violation and its cost."""
    worst = float(np.max(problem.constraints(controls), initial=0.0))
    return Solution(controls, worst if worst > TOLERANCE else 0.0, float(problem.cost(controls)), iterations)


class HorizonProblem(NamedTuple):
    """One robot's optimisation problem at one time; every length in metres, every time in seconds.

    The comment after a field is its shape and the paper's symbol.
    """

    period: float  # Delta t
    position: Row  # (d,) Pr_{t+1}; d = 2 in the plane, and 3 in space, with the height last
    velocity: Row  # (d,) V_{t+1}
    max_speed: float  # Vmax, f1
    max_acceleration: float  # Amax, f2
    tube_centre: Table  # (N, d) Rs_{t+s}, f3
    tube_radius: Row  # (N,) sigma_r of eq. (3); inf where the tube is free
    safe_distance: float  # Dmin, f4
    margin: float  # alpha
    obstacle_mean: Layers  # (K, N, d) Po_{t+s}; K = 0 while no obstacle is known
    obstacle_covariance: Layers  # (K, N, d (d + 1) / 2) C_{t+s} as (xx, xy, yy), or (xx, xy, xz, yy, yz, zz)
    peer_mean: Layers  # (n, N, d) Ro_{i,t+s}, f5
    peer_distance: Table  # (n, N) Dmin + alpha * sigma_5i
    objective: int = REACH_GOAL  # eq. (2); or INFORM, eq. (5)
    goal: Table = np.zeros((1, 2))  # (n, d) at steps 1..n of eq. (2); the last one is there for the other steps, too
    sigma_positions: Table = np.empty((0, 2))  # (T M, d) sigma points at t + N of the first T obstacles' positions
    sigma_weights: Row = np.empty(0)  # (M,) w_{t,i}
    others_distance: Table = np.empty((0, 0))  # (T M, M) exponent that the others' measurements add, mutual_information
    measurement_variance: float = 1.0  # eta_t of eq. (5), m^2
    range_penalty: float = 0.0  # gamma
    measurement_range: float = 0.0  # Dmax, f6
    # In space only.  f1 and f2 are ellipsoids: what climbs counts more, by the ratio of the limits.
    climb_speed: float = math.inf  # largest vertical speed
    climb_acceleration: float = math.inf  # largest vertical acceleration
    lowest: float = -math.inf  # f7, the height to stay above
    highest: float = math.inf  # f7, the height to stay below

    # --- as a ``Problem``, by the definitions -----------------------------------------------------------

    def cost(self, controls: Any, positive: Callable[[Any], Any] | None = None) -> Any:
        """What is to be minimised; ``positive`` may replace max(0, .)."""
        more = {} if positive is None else {"positive": positive}
        return definitions.objective(self.weighed(), definitions.driven(self, controls)[0], **more)

    def weighed(self) -> HorizonProblem:
        """The same problem without sigma points of weight 0, which have no effect, and no logarithm."""
        if self.sigma_weights.dtype == object or self.sigma_weights.all():
            return self
        heavy = self.sigma_weights > 0.0
        rows = np.resize(heavy, len(self.sigma_positions))  # of each target
        return self._replace(
            sigma_positions=self.sigma_positions[rows],
            sigma_weights=self.sigma_weights[heavy],
            others_distance=self.others_distance[np.ix_(rows, heavy)] if heavy.any() else np.empty((0, 0)),
        )

    def constraints(self, controls: Any) -> Any:
        """f3 to f5 with their margins, and f7, m: satisfied where <= 0."""
        return within_reach(definitions.violations(self, controls).ravel())

    def limits(self, controls: Any) -> Any:
        """f1 of all speeds but the first, which is decided already, and f2."""
        speeds = f1(driven(self, controls)[1][1:], self.max_speed, self.climb_speed)
        return np.concatenate([speeds, f2(controls, self.max_acceleration, self.climb_acceleration)])

    def solution(self, controls: Array, iterations: int = 0) -> Solution:
        """The answer of a solver, with its violation of the constraints and its cost."""
        return solution(self, controls, iterations)

    @property
    def arrays(self) -> list[Any]:
        """All numbers but the kind of objective."""
        return [value for name, value in zip(self._fields, self, strict=True) if name != "objective"]

    @property
    def key(self) -> Any:
        """What else there is."""
        return self.objective

    def of(self, arrays: Sequence[Any]) -> HorizonProblem:
        """The same problem of other numbers, or of symbols."""
        names = [name for name in self._fields if name != "objective"]
        return self._replace(**dict(zip(names, arrays, strict=True)))

    # --- the objectives that kernels know ---------------------------------------------------------------

    def to_reach(self, goal: Array) -> HorizonProblem:
        """The same problem with the objective of eq. (2); a ``goal`` (d,) that stands still, or (N, d) at each step."""
        return self._replace(objective=REACH_GOAL, goal=np.array(goal).reshape(-1, np.shape(goal)[-1]))

    def to_inform(
        self,
        points: Array,
        weights: Array,
        others: Array,
        variance: float,
        gamma: float,
        reach: float,
        across: float | None = None,
    ) -> HorizonProblem:
        """The same problem with the objective of eq. (5), in which ``others`` (n, N, d) also measure at their ends.

        Of several targets, one after the other in ``points`` (T M, d), it is the sum.  With ``across``, the variance of
        directions, what two points differ by across the line of sight is the rest of their distance, which no robot's
        place changes: it counts as a constant, and ranges by as much more as they say more.
        """
        size = len(weights)
        if across is not None:
            variance = math.inf if variance == across else 1.0 / (1.0 / variance - 1.0 / across)
        if len(points) == size:
            distance = pairwise_distance(points, others, variance)
        else:
            each = [pairwise_distance(points[i : i + size], others, variance) for i in range(0, len(points), size)]
            distance = np.concatenate(each)
        if across is not None:
            robots, targets = len(others) + 1, points.reshape(-1, size, points.shape[1])
            offsets = (targets[:, :, np.newaxis] - targets[:, np.newaxis]).reshape(-1, size, points.shape[1])
            for c in range(points.shape[1]):
                distance = distance + robots * offsets[:, :, c] * offsets[:, :, c] / (2.0 * across)
        return self._replace(
            objective=INFORM,
            sigma_positions=points,
            sigma_weights=weights,
            others_distance=distance,
            measurement_variance=variance,
            range_penalty=gamma,
            measurement_range=reach,
        )


@inner
def trajectory(position: Array, velocity: Array, controls: Array, period: float, steps: int) -> Array:
    """Positions at steps 1..``steps`` from the state at step 1 and the controls from there on, shape (steps, d).

    The equality constraint of eq. (2): ``P' = P + period * V``, ``V' = V + period * U``; past the last control the
    velocity is kept.
    """
    d = position.shape[0]
    positions = np.empty((steps, d))
    for c in range(d):
        p, v = position[c], velocity[c]
        for s in range(steps):
            positions[s, c] = p
            p += period * v
            if s < controls.shape[0]:
                v += period * controls[s, c]
    return positions
