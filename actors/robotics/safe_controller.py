"""A controller that can always still turn away from the target, whatever the target does within its bounds."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np

from ..core import OutputPort, Parameter, ParameterError
from ..core.elementary import cos, sin
from .arrays import Array, floats
from .controller import RobustController
from .integrated_ou import IntegratedOU
from .messages import BodyState
from .receiving import PLANE

if TYPE_CHECKING:
    from .problem import Problem

_DIRECTIONS = 64  # of a retreat that are tried
_SHARES = 1.0, 0.75, 0.5, 0.25  # of the planned control, the rest being that of the retreat


class _Retreat(NamedTuple):
    """A retreat that was certain to keep the safe distance."""

    direction: Array  # (2,), of unit length
    reach: float  # m, the targets' largest coordinate along it
    time: float  # s, when that was so


class SafeController(IntegratedOU, RobustController):
    """A ``RobustController`` that also keeps a retreat open, for a target of bounded speed.

    It differs in two things:

    * It predicts the target as one that roams (``IntegratedOU``), and keeps ``sigma_margin`` standard deviations from
      it; ``margin`` is for other robots alone.
    * A plan's first control is sent only if, after it, there is a retreat: a direction in which the robot, once it
      accelerates that way with all it has, is certain to keep ``safe_distance`` for ever, wherever the target is within
      ``sigma_margin`` standard deviations of its estimate, and wherever it goes at up to ``target_speed``.  Otherwise
      the control is mixed with that of the last retreat that was certain, or replaced by it.

    So if the estimate is right to ``sigma_margin`` standard deviations whenever a retreat is found, and the robot moves
    as its controls say, then it never comes within ``safe_distance``: a retreat that was certain stays so.  A retreat
    is from all targets that are known, those of ``tracks`` included; one that becomes known later was not in an earlier
    retreat.  Other robots are avoided by the plan alone.  Before there is a first retreat, the best one that there is
    decides.
    """

    unused: ClassVar[tuple[str, ...]] = "position_noise", "velocity_noise", "covariance_noise"
    _of_target = PLANE  # the model of its motion is

    overrides = OutputPort(int, doc="number of controls so far that a retreat has changed")

    sigma_margin = Parameter(float, 3.5, unit="1", min=0, doc="standard deviations to keep from the target")

    refused: ClassVar[Mapping[str, str]] = {
        "confidence": "SafeController's parameter 'confidence' is now called 'sigma_margin'"
    }

    def check(self) -> None:
        super().check()
        if self.dimensions != 2:
            raise ParameterError(f"dimensions: it is {self.dimensions}, and retreats are in the plane; leave it out")

    def initialize(self) -> None:
        from .numerics import reachability, retreat, ukf
        from .numerics.warm_up import compile_retreats

        super().initialize()
        compile_retreats()
        self._expected_target: Callable[..., tuple[Array, Array, Array, Array]] = self._predicted
        self._propagate, self._predict, self._sigma_points = reachability.propagate, ukf.predict, ukf.sigma_points
        self._support, self._kept, self._best = retreat.support, retreat.kept_distance, retreat.best_retreat
        turn = 2.0 * math.pi / _DIRECTIONS
        self._directions = np.array([(cos(i * turn), sin(i * turn)) for i in range(_DIRECTIONS)])
        self._limits = self.target_speed, self.max_speed, self.max_acceleration, self.period
        self._retreat: _Retreat | None = None
        self._overrides = 0

    def _predicted(
        self, mean: Array, covariance: Array, noise: Array, is_widened: bool, kappa: float, period: float,
        elapsed: float, steps: int, dimensions: int,
    ) -> tuple[Array, Array, Array, Array]:  # fmt: skip
        """``reachability.expected_target`` for a target that roams."""
        mean, covariance = mean.copy(), covariance.copy()  # kernels would be compiled again for read-only arrays
        if elapsed > 0.0:
            mean, covariance = self._predict(mean, covariance, *self.motion(elapsed))
        means, covariances = self._propagate(mean, covariance, *self.motion(period), steps, dimensions)
        points, weights = self._sigma_points(*self._predict(mean, covariance, *self.motion(steps * period)), kappa)
        return means[np.newaxis], covariances[np.newaxis], points[:, :2].copy(), weights

    def _problem(self, own: BodyState) -> tuple[Problem, Array]:
        problem, starts = super()._problem(own)
        return problem._replace(margin=self.sigma_margin), starts

    def _send(self, own: BodyState, problem: Problem, controls: Array) -> None:
        if self._targets():
            first = self._safe(own.time, problem, controls[0])
            if first is not controls[0] and (first != controls[0]).any():
                controls = controls.copy()
                controls[0] = first
                self._overrides += 1
        self.overrides.send(self._overrides)
        super()._send(own, problem, controls)

    # --- retreats ---------------------------------------------------------------------------------------

    def _safe(self, now: float, problem: Problem, planned: Array) -> Array:
        """The control to send in place of the planned one: itself, if it leaves a retreat."""
        start, last = (problem.state[:2], problem.state[2:]), self._retreat
        reaches = np.full(_DIRECTIONS, -math.inf)  # of the target that reaches farthest in each direction
        for target in self._targets():
            estimate = target.mean.copy(), target.covariance.copy(), max(now - target.time, 0.0)
            reach = self._support(self._directions, *estimate, self.sigma_margin, self.target_speed)
            reaches = np.maximum(reaches, reach)
        for share in _SHARES if last is not None else _SHARES[:1]:
            control = planned if last is None else share * planned + (1.0 - share) * self._away(last)
            kept, row = self._best(self._directions, reaches, *start, control, *self._limits)
            if kept >= self.safe_distance:
                self._retreat = _Retreat(self._directions[row], float(reaches[row]), now)
                return control
            if last is not None:
                moved, (x, y) = last.reach + self.target_speed * (now - last.time), floats(last.direction)
                if self._kept(x, y, moved, *start, control, *self._limits) >= self.safe_distance:
                    return control
        if last is not None:
            return self._away(last)
        return self._away(_Retreat(self._directions[row], float(reaches[row]), now))

    def _away(self, retreat: _Retreat) -> Array:
        away: Array = self.max_acceleration * retreat.direction
        return away
