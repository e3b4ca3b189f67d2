"""Estimates of the target from all robots' measurements."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from ..core import Actor, InputPort, OutputPort, Parameter, array_parameter
from .messages import RANGE, RELATIVE_POSITION, Array, Estimate, Measurement

EXPECTED, PREDICTED = "expected", "predicted"


class _Estimator(Actor):
    """What all estimators share: the model of eq. (1), and one prediction and fusion at each trigger.

    A measurement that arrives between two triggers is fused at the next one as if it were made then, unless its robot
    has sent a later one by that time.  One that is not finite is ignored, and so is an update whose result would not
    be.
    """

    trigger = InputPort(object, doc="predict to the present time, fuse, and send the estimate")
    measurements = InputPort(Measurement, multi=True, required=False, doc="of all robots, own included")
    estimate = OutputPort(Estimate, doc="the target's state (x, y, vx, vy) after fusion")

    period = Parameter(float, 0.1, unit="s", min=1e-9, doc="the time over which the process noise was measured")
    position_noise = Parameter(float, 0.002, unit="m^2", min=0, doc="Qp: variance a position gains in one period")
    velocity_noise = Parameter(
        float,
        0.4,
        unit="m^2/s^2",
        min=0,
        doc="Qv: variance a velocity gains in one period; Table II's 0.004 is in (m per 0.1 s)^2",
    )
    prior_mean = array_parameter((4,), (10.0, 0.0, 0.0, 0.0), doc="first guess of (x, y, vx, vy) in m and m/s")
    prior_variance = array_parameter((4,), (400.0, 400.0, 4.0, 4.0), min=0, doc="its variances, in m^2 and m^2/s^2")

    noise_direction = Parameter(
        str,
        EXPECTED,
        choices=(EXPECTED, PREDICTED),
        doc="the noise ellipse is averaged over the directions that the prediction allows, or turned along its mean",
    )

    def initialize(self) -> None:
        from .numerics import ukf
        from .numerics.warm_up import compile_kernels

        compile_kernels()
        self._kinds = {RANGE: ukf.RANGE, RELATIVE_POSITION: ukf.RELATIVE_POSITION}
        self._predicted_at: int | None = None
        self._late: dict[tuple[str, str], Measurement] = {}  # what came since the last trigger
        self._process_noise = np.diag([self.position_noise] * 2 + [self.velocity_noise] * 2)

    def fire(self) -> None:
        present = [each for each in self.measurements.tokens if each.finite]
        if not self.trigger.present:
            self._late.update({(each.robot, each.kind): each for each in present})
            return
        now = self.tag.time
        elapsed = 0.0 if self._predicted_at is None else (now - self._predicted_at) / 1e9
        self._predicted_at = now
        if self._late:
            known = {(each.robot, each.kind) for each in present}
            present += [late for source, late in self._late.items() if source not in known]
            self._late.clear()
        # Sorted, so that the order of arrival decides nothing, not even the last bit.
        usable = sorted(present, key=_order)
        fused = self._step(elapsed, usable)
        sources = dict.fromkeys(each.robot for each in usable) if fused else ()
        self.estimate.send(Estimate(*self._state(), tuple(sources)))

    def _step(self, elapsed: float, measurements: list[Measurement]) -> bool:
        """Predict over ``elapsed`` seconds, 0 at the first trigger, and fuse; whether anything was fused."""
        raise NotImplementedError

    def _state(self) -> tuple[Array, Array]:
        """Mean and covariance."""
        raise NotImplementedError

    def _noise_over(self, elapsed: float) -> Array:
        """The process noise of so many seconds."""
        noise: Array = self._process_noise * (elapsed / self.period)
        return noise

    def _rows(self, measurements: list[Measurement]) -> Array:
        """The measurements (m, 7) as the kernels take them."""
        kinds = self._kinds
        rows = [
            (kinds[each.kind], *each.observer.tolist(), *[*each.value.tolist(), 0.0][:2], each.along, each.across)
            for each in measurements
        ]
        return np.array(rows, np.float64).reshape(-1, 7)


def _order(measurement: Measurement) -> Any:
    return measurement.robot, measurement.kind, measurement.observer.tolist(), measurement.value.tolist()


class UnscentedEstimator(_Estimator):
    """The unscented Kalman filter of the paper, compiled; fuses all measurements of a tag at once."""

    kappa = Parameter(float, 0.0, unit="1", min=0, doc="spread of the 9 sigma points; 0 gives the centre no weight")

    def initialize(self) -> None:
        from .numerics import ukf

        super().initialize()
        self._move_and_fuse = ukf.predict_and_fuse  # kept, as an import takes 1 us whenever it is met
        self._model = lru_cache(8)(lambda elapsed: (ukf.constant_velocity(elapsed), self._noise_over(elapsed)))
        self._mean = np.array(self.prior_mean)
        self._covariance = np.diag(self.prior_variance)

    def _step(self, elapsed: float, measurements: list[Measurement]) -> bool:
        transition, noise = self._model(elapsed)  # nearly always the same
        self._mean, self._covariance, fused = self._move_and_fuse(
            self._mean,
            self._covariance,
            transition,
            noise,
            self.kappa,
            self._rows(measurements),
            self.noise_direction == EXPECTED,
        )
        return fused

    def _state(self) -> tuple[Array, Array]:
        return self._mean, self._covariance
