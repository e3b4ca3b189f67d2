"""Estimates of the target from all robots' measurements."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ..core import Actor, InputPort, OutputPort, Parameter, array_parameter
from .messages import RANGE, Array, Estimate, Measurement, all_finite

EXPECTED, PREDICTED = "expected", "predicted"


class _Columns(NamedTuple):
    """Some measurements as the kernels take them."""

    kinds: Array  # (m,) the kernels' numbers
    observers: Array  # (m, 2)
    values: Array  # (m, 2); of a range the first counts
    deviations: Array  # (m, 2) along and across the line of sight


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
        # Kept, as an import takes 1 us whenever it is met.
        self._sigma_points, self._measurement_noise = ukf.sigma_points, ukf.measurement_noise
        self._ranged, self._relative = float(ukf.RANGE), float(ukf.RELATIVE_POSITION)
        self._predicted_at: int | None = None
        self._late: dict[tuple[str, str], Measurement] = {}  # what came since the last trigger
        self._process_noise = np.diag([self.position_noise] * 2 + [self.velocity_noise] * 2)

    def fire(self) -> None:
        if not self.trigger.present:
            self._late.update({(each.robot, each.kind): each for each in self.measurements.tokens if each.finite})
            return
        now = self.tag.time
        if self._predicted_at is not None and now > self._predicted_at:
            self._predict((now - self._predicted_at) / 1e9)
        self._predicted_at = now
        present = [each for each in self.measurements.tokens if each.finite]
        if self._late:
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

    def _columns(self, measurements: list[Measurement]) -> _Columns:
        """The measurements as the kernels take them."""
        # From lists, as np.array takes ten times as long to make one array of several.
        return _Columns(
            np.array([self._ranged if each.kind == RANGE else self._relative for each in measurements]),
            np.array([each.observer.tolist() for each in measurements]),
            np.array([[*each.value.tolist(), 0.0][:2] for each in measurements]),
            np.array([(each.along, each.across) for each in measurements], dtype=float),
        )

    def _noises(self, columns: _Columns) -> Array:
        """The measurements' covariances (m, 3), all as seen from the prediction, whatever the order of fusion."""
        mean, covariance = self._state()
        if self.noise_direction == EXPECTED:
            points, weights = self._sigma_points(mean, covariance, 0.0)
        else:
            points, weights = np.array(mean)[np.newaxis], np.ones(1)
        return self._measurement_noise(points, weights, columns.kinds, columns.observers, columns.deviations)


def _order(measurement: Measurement) -> Any:
    return measurement.robot, measurement.kind, measurement.observer.tolist(), measurement.value.tolist()


class UnscentedEstimator(_Estimator):
    """The unscented Kalman filter of the paper, compiled; fuses all measurements of a tag at once."""

    kappa = Parameter(float, 0.0, unit="1", min=0, doc="spread of the 9 sigma points; 0 gives the centre no weight")

    def initialize(self) -> None:
        from .numerics.ukf import constant_velocity, predict, update

        super().initialize()
        self._transition = lru_cache(8)(constant_velocity)  # it is nearly always the same
        self._move, self._fuse = predict, update
        self._mean = np.array(self.prior_mean)
        self._covariance = np.diag(self.prior_variance)

    def _predict(self, elapsed: float) -> None:
        noise = self._process_noise * (elapsed / self.period)
        self._mean, self._covariance = self._move(self._mean, self._covariance, self._transition(elapsed), noise)

    def _update(self, measurements: list[Measurement]) -> bool:
        columns = self._columns(measurements)
        kinds, observers, values, _ = columns
        noises = self._noises(columns)
        mean, covariance = self._fuse(self._mean, self._covariance, self.kappa, kinds, observers, values, noises)
        if not all_finite(mean.tolist() + covariance.ravel().tolist()):
            return False
        self._mean, self._covariance = mean, covariance
        return True

    def _state(self) -> tuple[Array, Array]:
        return self._mean, self._covariance
