"""FilterPy's filters instead of the compiled one: slower, but independent, for comparison."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core import EpicycleError, Parameter
from ..core.elementary import hypot
from .arrays import Array
from .estimator import EXPECTED, KalmanEstimator, State
from .messages import Estimate, Measurement
from .sensor_models import RANGE

# FilterPy's EnsembleKalmanFilter is left out: it draws from NumPy's global random state, so runs would not be
# reproducible.
LINEAR = ("KalmanFilter", "SquareRootKalmanFilter")
NONLINEAR = ("ExtendedKalmanFilter", "UnscentedKalmanFilter", "CubatureKalmanFilter")


class FilterError(EpicycleError):
    """A filter cannot use the measurements it got."""


class FilterPyEstimator(KalmanEstimator):
    """A filter of FilterPy with the model of ``UnscentedEstimator``; fuses one measurement after another.

    Late measurements are fused at their own time, as there.

    ``KalmanFilter`` and ``SquareRootKalmanFilter`` are linear and take relative positions only.
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
        for each in measurements:
            self._check(each)
        noises = self._noises(measurements)
        before = np.array(self._filter.x), np.array(self._filter.P)
        for each, (xx, xy, yy) in zip(measurements, noises, strict=True):
            ranged = each.kind == RANGE
            self._fuse(each, np.array([[xx]]) if ranged else np.array([[xx, xy], [xy, yy]]))
        if np.isfinite(self._filter.x).all() and np.isfinite(self._filter.P).all():
            return True
        self._filter.x, self._filter.P = before
        return False

    def _check(self, measurement: Measurement) -> None:
        if type(measurement) is not Measurement:
            raise FilterError(
                f"{self.path}: FilterPy's filters take relative positions and ranges, and {measurement.robot} has a "
                f"{measurement.kind}; use an UnscentedEstimator, an ExtendedEstimator or a ParticleEstimator"
            )
        if len(measurement.observer) != 2:
            raise FilterError(
                f"{self.path}: FilterPy's filters take observers in the plane, and {measurement.robot} measures from a "
                "height; use an UnscentedEstimator"
            )

    def _noises(self, measurements: list[Measurement]) -> Array:
        """The measurements' covariances (m, 3), all as seen from the prediction, independent of the order of fusion."""
        from .numerics.ukf import measurement_noise, sigma_points

        mean, covariance = self._told((self._filter.x, self._filter.P))
        if self.noise_direction == EXPECTED:
            points, weights = sigma_points(mean, covariance, self.kappa)
        else:
            points, weights = np.array(mean)[np.newaxis], np.ones(1)
        return measurement_noise(points, weights, self._rows(measurements))

    def _fuse(self, measurement: Measurement, noise: Array) -> None:
        observer, ranged = measurement.observer, measurement.kind == RANGE
        used = self._filter

        def observe(state: Array) -> Array:
            offset = state[:2] - observer
            return np.array([hypot(*offset.tolist())]) if ranged else np.array(offset)

        def slope(state: Array) -> Array:
            if not ranged:
                return np.eye(2, 4)
            offset = state[:2] - observer
            return np.array([[*(offset / max(hypot(*offset.tolist()), 1e-9)), 0.0, 0.0]])

        if self.filter in LINEAR:
            if ranged:
                raise FilterError(
                    f"{self.path}: FilterPy's {self.filter} is linear and cannot fuse a range (from "
                    f"{measurement.robot}); set 'filter' to one of {', '.join(NONLINEAR)}, or the sensor's 'kind' to "
                    "relative_position"
                )
            position = measurement.value + observer
            if self.filter == "SquareRootKalmanFilter":
                used.update(position, np.linalg.cholesky(noise))
            else:
                used.update(position, R=noise)
        elif self.filter == "ExtendedKalmanFilter":
            used.update(measurement.value, slope, observe, R=noise)
        elif self.filter == "UnscentedKalmanFilter":
            # Its points stay where the prediction left them; a second update needs them around the first
            # one's result.
            used.sigmas_f = used.points_fn.sigma_points(used.x, used.P)
            used.update(measurement.value, R=noise, hx=observe)
        else:
            # It keeps the propagated points, which hold no process noise; draw them from the prediction
            # instead.
            from filterpy.kalman import spherical_radial_sigmas

            used.sigmas_f = spherical_radial_sigmas(used.x, used.P)
            used.sigmas_h = np.zeros((len(used.sigmas_f), len(measurement.value)))
            used.hx = observe
            used.update(measurement.value[:, np.newaxis], R=noise)

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
