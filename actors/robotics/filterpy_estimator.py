"""FilterPy's filters instead of the compiled one: slower, but independent, for comparison."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core import EpicycleError, Parameter
from .arrays import Array, floats
from .estimator import KalmanEstimator, State, slopes
from .messages import Estimate, Measurement
from .sensor_models import RELATIVE_POSITION

# FilterPy's EnsembleKalmanFilter is left out: it draws from NumPy's global random state, so runs would not be
# reproducible.
LINEAR = ("KalmanFilter", "SquareRootKalmanFilter")
NONLINEAR = ("ExtendedKalmanFilter", "UnscentedKalmanFilter", "CubatureKalmanFilter")


class FilterError(EpicycleError):
    """A filter cannot use the measurements it got."""


class FilterPyEstimator(KalmanEstimator):
    """A filter of FilterPy with the model of ``UnscentedEstimator``; fuses one measurement after another.

    Late measurements are fused at their own time, as there.

    ``KalmanFilter`` and ``SquareRootKalmanFilter`` are linear and take relative positions only; the others take an
    ``Observation`` of any sensor.
    """

    filter = Parameter(
        str, "UnscentedKalmanFilter", choices=NONLINEAR + LINEAR, doc="name of the class in filterpy.kalman"
    )

    def initialize(self) -> None:
        super().initialize()
        self._filter = _make_filter(self.filter, self.kappa)
        self._at: State | None = None  # its state

    def step(self, state: State, elapsed: float, measurements: list[Measurement]) -> tuple[State, bool]:
        if state is not self._at:
            self._filter.x, self._filter.P = map(np.array, state)
        if elapsed > 0.0:
            self._move(elapsed)
        fused = bool(measurements) and self._update(measurements)
        self._at = np.array(self._filter.x), np.array(self._filter.P)
        return self._at, fused

    def prior(self) -> State:
        mean, covariance = super().prior()
        return mean.reshape(4, 1) if self.filter == "CubatureKalmanFilter" else mean, covariance  # which needs columns

    def _move(self, elapsed: float) -> None:
        from .numerics.ukf import constant_velocity

        self._filter.Q = self._noise_over(elapsed)
        if self.filter in ("UnscentedKalmanFilter", "CubatureKalmanFilter"):
            self._filter.predict(dt=elapsed)
        else:
            self._filter.F = constant_velocity(elapsed)
            self._filter.predict()

    def _update(self, measurements: list[Measurement]) -> bool:
        before = np.array(self._filter.x), np.array(self._filter.P)
        mean, covariance = self._told(before)
        points, weights = self._sigma_points(mean, covariance, self.kappa)
        # All as seen from the prediction, independent of the order of fusion.
        noises = [self._noise_of(each, mean, points, weights) for each in measurements]
        for each, noise in zip(measurements, noises, strict=True):
            self._fuse(each, noise)
        if np.isfinite(self._filter.x).all() and np.isfinite(self._filter.P).all():
            return True
        self._filter.x, self._filter.P = before
        return False

    def _fuse(self, measurement: Measurement, noise: Array) -> None:
        used = self._filter
        if self.filter in LINEAR:
            if measurement.kind != RELATIVE_POSITION:
                raise FilterError(
                    f"{self.path}: FilterPy's {self.filter} is linear and cannot fuse a {measurement.kind} (from "
                    f"{measurement.robot}); set 'filter' to one of {', '.join(NONLINEAR)}, or the sensor's 'kind' to "
                    "relative_position"
                )
            position, noise = (measurement.value + measurement.observer)[:2], noise[:2, :2]
            if self.filter == "SquareRootKalmanFilter":
                used.update(position, np.linalg.cholesky(noise))
            else:
                used.update(position, R=noise)
            return
        # Differences to what is measured at the mean, so that angles near a half turn do no harm.
        mean = floats(np.ravel(used.x))
        there, error = measurement.expected(mean), np.array(measurement.innovation(mean), dtype=float)

        def observe(state: Array) -> Array:
            return np.array(measurement.sensor.difference(measurement.expected(floats(state)), there), dtype=float)

        if self.filter == "ExtendedKalmanFilter":
            used.update(error, lambda state: np.transpose(slopes(measurement, floats(state))), observe, R=noise)
        elif self.filter == "UnscentedKalmanFilter":
            # Its points stay where the prediction left them; a second update needs them around the first
            # one's result.
            used.sigmas_f = used.points_fn.sigma_points(used.x, used.P)
            used.update(error, R=noise, hx=observe)
        else:
            # It keeps the propagated points, which hold no process noise; draw them from the prediction
            # instead.
            from filterpy.kalman import spherical_radial_sigmas

            used.sigmas_f = spherical_radial_sigmas(used.x, used.P)
            used.sigmas_h = np.zeros((len(used.sigmas_f), len(error)))
            used.hx = observe
            used.update(error[:, np.newaxis], R=noise)

    def _told(self, state: State) -> State:
        return np.array(state[0]).ravel(), 0.5 * (state[1] + state[1].T)

    def estimate_of(self, state: State, time: float, sources: tuple[str, ...]) -> Estimate:
        return Estimate(*self._told(state), time, sources)


def _make_filter(name: str, kappa: float) -> Any:
    from filterpy import kalman  # takes seconds, so only when it is used

    from .numerics.definitions import target_after

    if name == "UnscentedKalmanFilter":
        points = kalman.JulierSigmaPoints(4, kappa=kappa)
        made = kalman.UnscentedKalmanFilter(4, 2, 1.0, hx=_unused, fx=target_after, points=points)
    elif name == "CubatureKalmanFilter":
        made = kalman.CubatureKalmanFilter(4, 2, 1.0, hx=_unused, fx=target_after)
    else:
        made = getattr(kalman, name)(4, 2)
        if name != "ExtendedKalmanFilter":
            made.H = np.eye(2, 4)
    return made


def _unused(state: Array) -> Array:
    raise NotImplementedError("every update needs its own measurement function")
