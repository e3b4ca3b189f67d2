"""A target of bounded speed: its model, and an estimator that uses it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ..core import Configurable, Parameter, ParameterError
from ..core.elementary import exp
from ..core.parameter import declared_parameters
from .arrays import Array
from .estimator import State, UnscentedEstimator
from .messages import Measurement


class IntegratedOU(Configurable):
    """The parameters of a target that roams: its speed is bounded, and it turns now and then.

    Its velocity is an Ornstein-Uhlenbeck process with the standard deviation ``target_speed / sqrt(2)`` in each
    direction (integrated, it is the IOU model of target tracking).  However long nothing is heard of it, its predicted
    speed stays bounded, while under eq. (1) its velocity is a random walk.
    """

    unused: ClassVar[tuple[str, ...]] = "position_noise", "velocity_noise"  # of the random walk of eq. (1)

    target_speed = Parameter(float, 1.5, unit="m/s", min=1e-6, doc="largest speed of the target")

    turn_time = Parameter(float, 2.0, unit="s", min=1e-3, doc="time in which the target forgets its direction")

    def check(self) -> None:
        """Refuse inherited parameters that would do nothing."""
        super().check()
        for name in self.unused:
            if getattr(self, name) != declared_parameters(type(self))[name].default:
                raise ParameterError(
                    f"it has no effect in {type(self).__name__}, whose target roams; leave it out, and set "
                    "'target_speed' and 'turn_time'",
                    (name,),
                )

    def motion(self, elapsed: float) -> tuple[Array, Array]:
        """The transition (4, 4) of the state (x, y, vx, vy) over a time, and the covariance (4, 4) that it gains."""
        from .numerics.definitions import integrated_ou

        return integrated_ou(self.target_speed, self.turn_time, elapsed, exp(-elapsed / self.turn_time))


class IntegratedOUEstimator(IntegratedOU, UnscentedEstimator):
    """The paper's filter with two changes, for a ``SafeController``; the process noise of eq. (1) is not used.

    The target roams (``IntegratedOU``).  By eq. (1), with the noise of Table II as it is read here
    (``velocity_noise``), the deviation of its velocity grows by 2 m/s in a second; the estimate follows the noise
    across the line of sight, and may swing to the other side of it.

    Measurements are fused in the frame of the true line of sight (``numerics.lines_of_sight``), which depends on where
    the target is; and a measurement that surprises the filter widens its estimate, as in a filter of Student's t.
    """

    degrees_of_freedom = Parameter(
        float,
        4.0,
        unit="1",
        above=0,
        max=1e12,
        doc="degrees of freedom of the noise; the fewer, the more it may surprise",
    )

    refused: ClassVar[Mapping[str, str]] = {
        "freedom": "IntegratedOUEstimator's parameter 'freedom' is now called 'degrees_of_freedom'"
    }

    def initialize(self) -> None:
        from .numerics import lines_of_sight
        from .numerics.warm_up import compile_retreats

        super().initialize()
        compile_retreats()
        self._sight = lines_of_sight.predict_and_fuse

    def _step(self, state: State, elapsed: float, measurements: list[Measurement]) -> tuple[State, bool]:
        given = *state, *self._model(elapsed), self.kappa, self._rows(measurements), self.degrees_of_freedom
        mean, covariance, fused = self._sight(*given)
        return (mean, covariance), fused
