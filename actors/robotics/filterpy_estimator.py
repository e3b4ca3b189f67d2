"""FilterPy's filters instead of the compiled one: slower, but independent, for comparison."""

from __future__ import annotations

from collections.abc import Callable
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


class _BeyondError(Exception):
    """FilterPy cannot compute with such numbers."""


def _by_filterpy(function: Callable[..., Any], *given: Any, **named: Any) -> Any:
    """What FilterPy makes of numbers that may be huge; raises ``_BeyondError`` where NumPy or SciPy raise."""
    try:
        return function(*given, **named)
    except ValueError as error:  # a LinAlgError, too
        raise _BeyondError from error


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
        try:
            if state is not self._at:
                self._take(state)
            if elapsed > 0.0:
                self._move(elapsed)
            fused = bool(measurements) and self._update(measurements)
            self._at = self._state()
        except _BeyondError:
            # As the compiled filter predicts, and without the measurements.
            mean, covariance = self._predict(*self._told(state), *self._model(elapsed))
            self._at, fused = None, False
            return (mean.reshape(state[0].shape), covariance), fused
        return self._at, fused

    def prior(self) -> State:
        mean, covariance = super().prior()
        return mean.reshape(4, 1) if self.filter == "CubatureKalmanFilter" else mean, covariance  # which needs columns

    def _take(self, state: State) -> None:
        for name, value in zip("xP", state, strict=True):
            _by_filterpy(setattr, self._filter, name, np.array(value))

    def _state(self) -> State:
        """That of the filter; raises ``_BeyondError`` if it is not finite."""
        state = np.array(self._filter.x), np.array(self._filter.P)
        if not all(np.isfinite(each).all() for each in state):
            raise _BeyondError
        return state

    def _move(self, elapsed: float) -> None:
        from .numerics.ukf import constant_velocity

        _by_filterpy(setattr, self._filter, "Q", self._noise_over(elapsed))
        if self.filter in ("UnscentedKalmanFilter", "CubatureKalmanFilter"):
            _by_filterpy(self._filter.predict, dt=elapsed)
        else:
            self._filter.F = constant_velocity(elapsed)
            _by_filterpy(self._filter.predict)

    def _update(self, measurements: list[Measurement]) -> bool:
        """Fuse the measurements; whether that was possible."""
        before = self._state()
        mean, covariance = self._told(before)
        points, weights = self._sigma_points(mean, covariance, self.kappa)
        # All as seen from the prediction, independent of the order of fusion.
        noises = [self._noise_of(each, mean, points, weights) for each in measurements]
        try:
            for each, noise in zip(measurements, noises, strict=True):
                self._fuse(each, noise)
            self._state()
        except _BeyondError:
            self._take(before)
            return False
        return True

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
                noise = _by_filterpy(np.linalg.cholesky, noise)
            _by_filterpy(used.update, position, noise)
            return
        # Differences to what is measured at the mean, so that angles near a half turn do no harm.
        mean = floats(np.ravel(used.x))
        there, error = measurement.expected(mean), np.array(measurement.innovation(mean), dtype=float)

        def observe(state: Array) -> Array:
            return np.array(measurement.sensor.difference(measurement.expected(floats(state)), there), dtype=float)

        # A sensor's own errors are not FilterPy's: it is asked before.
        if self.filter == "ExtendedKalmanFilter":
            slope, seen = np.transpose(slopes(measurement, mean)), observe(np.array(mean))
            _by_filterpy(used.update, error, lambda state: slope, lambda state: seen, R=noise)
        elif self.filter == "UnscentedKalmanFilter":
            # Its points stay where the prediction left them; a second update needs them around the first
            # one's result.
            used.sigmas_f = _by_filterpy(used.points_fn.sigma_points, used.x, used.P)
            images = iter([observe(each) for each in used.sigmas_f])
            _by_filterpy(used.update, error, R=noise, hx=lambda state: next(images))
        else:
            # It keeps the propagated points, which hold no process noise; draw them from the prediction
            # instead.
            from filterpy.kalman import spherical_radial_sigmas

            used.sigmas_f = _by_filterpy(spherical_radial_sigmas, used.x, used.P)
            used.sigmas_h = np.zeros((len(used.sigmas_f), len(error)))
            images = iter([observe(each) for each in used.sigmas_f])
            used.hx = lambda state: next(images)
            _by_filterpy(used.update, error[:, np.newaxis], R=noise)

    def _told(self, state: State) -> State:
        return np.array(state[0]).ravel(), 0.5 * state[1] + 0.5 * state[1].T

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
