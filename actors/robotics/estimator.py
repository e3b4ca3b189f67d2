"""Estimates of the target from all robots' measurements."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core import Actor, InputPort, OutputPort, Parameter, array_parameter
from .messages import RANGE, Array, Estimate, Measurement

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
        from .numerics.warm_up import compile_kernels

        compile_kernels()
        self._predicted_at: int | None = None
        self._late: dict[tuple[str, str], Measurement] = {}  # what came since the last trigger
        self._process_noise = np.diag([self.position_noise] * 2 + [self.velocity_noise] * 2)

    def fire(self) -> None:
        if not self.trigger.present:
            self._late.update({(each.robot, each.kind): each for each in self.measurements.tokens if each.finite})
            return
        if self._predicted_at is not None and self.tag.time > self._predicted_at:
            self._predict((self.tag.time - self._predicted_at) / 1e9)
        self._predicted_at = self.tag.time
        present = [each for each in self.measurements.tokens if each.finite]
        known = {(each.robot, each.kind) for each in present}
        present += [late for source, late in self._late.items() if source not in known]
        self._late.clear()
        # Sorted, so that the order of arrival decides nothing, not even the last bit.
        usable = sorted(present, key=_order)
        fused = bool(usable) and self._update(usable)
        sources = sorted({each.robot for each in usable}) if fused else ()
        self.estimate.send(Estimate(*self._state(), tuple(sources)))

    def _predict(self, elapsed: float) -> None:
        raise NotImplementedError

    def _update(self, measurements: list[Measurement]) -> bool:
        """Fuse; whether it worked."""
        raise NotImplementedError

    def _state(self) -> tuple[Array, Array]:
        """Mean and covariance."""
        raise NotImplementedError

    def _noises(self, measurements: list[Measurement]) -> Array:
        """The measurements' covariances (m, 3), all as seen from the prediction, whatever the order of fusion."""
        from .numerics.ukf import measurement_noise, sigma_points

        mean, covariance = self._state()
        points, weights = np.array(mean)[np.newaxis], np.ones(1)
        if self.noise_direction == EXPECTED:
            points, weights = sigma_points(mean, covariance, 0.0)
        observers = np.array([each.observer for each in measurements])
        deviations = np.array([(each.along, each.across) for each in measurements], dtype=float)
        return measurement_noise(points, weights, kinds_of(measurements), observers, deviations)


def kinds_of(measurements: list[Measurement]) -> Array:
    """The kernels' numbers for the measurements' kinds."""
    from .numerics import ukf

    return np.array([ukf.RANGE if each.kind == RANGE else ukf.RELATIVE_POSITION for each in measurements], dtype=float)


def _order(measurement: Measurement) -> Any:
    return measurement.robot, measurement.kind, measurement.observer.tolist(), measurement.value.tolist()


class UnscentedEstimator(_Estimator):
    """The unscented Kalman filter of the paper, compiled; fuses all measurements of a tag at once."""

    kappa = Parameter(float, 0.0, unit="1", min=0, doc="spread of the 9 sigma points; 0 gives the centre no weight")

    def initialize(self) -> None:
        super().initialize()
        self._mean = np.array(self.prior_mean)
        self._covariance = np.diag(self.prior_variance)

    def _predict(self, elapsed: float) -> None:
        from .numerics.ukf import constant_velocity, predict

        noise = self._process_noise * (elapsed / self.period)
        self._mean, self._covariance = predict(self._mean, self._covariance, constant_velocity(elapsed), noise)

    def _update(self, measurements: list[Measurement]) -> bool:
        from .numerics.ukf import update

        values = np.zeros((len(measurements), 2))
        for row, each in zip(values, measurements, strict=True):
            row[: len(each.value)] = each.value
        observers = np.array([each.observer for each in measurements])
        noises = self._noises(measurements)
        kinds = kinds_of(measurements)
        mean, covariance = update(self._mean, self._covariance, self.kappa, kinds, observers, values, noises)
        if not (np.isfinite(mean).all() and np.isfinite(covariance).all()):
            return False
        self._mean, self._covariance = mean, covariance
        return True

    def _state(self) -> tuple[Array, Array]:
        return self._mean, self._covariance
