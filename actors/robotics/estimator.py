"""Estimates of the target from all robots' measurements, and what they assume of its motion, eq. (1)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, TypeAlias

import numpy as np

from ..core import Actor, Configurable, InputPort, OutputPort, Parameter, Stream, array_parameter, to_seconds
from .arrays import Array, array_of, floats, stacked
from .history import History, Step
from .messages import Estimate, Measurement
from .receiving import received
from .sensor_models import RANGE, RELATIVE_POSITION

EXPECTED, PREDICTED = "expected", "predicted"
_NOTHING = 0.0, 0.0
State: TypeAlias = tuple[Array, Array]  # of a Kalman filter: mean and covariance, never modified


class TargetModel(Configurable):
    """The parameters shared by a filter and an actor that predicts from its estimates."""

    position_noise = Parameter(float, 0.002, unit="m^2", min=0, doc="Qp: variance a position gains in one period")
    velocity_noise = Parameter(
        float,
        0.4,
        unit="m^2/s^2",
        min=0,
        doc="Qv: variance a velocity gains in one period; Table II's 0.004 is in (m per 0.1 s)^2",
    )
    kappa = Parameter(float, 0.0, unit="1", min=0, doc="spread of the 9 sigma points; with 0, the centre has no weight")

    def process_noise(self, dimensions: int = 2) -> Array:
        """The covariance (2 d, 2 d) that the state, (x, y, vx, vy) in the plane, gains in one period."""
        return np.diag([self.position_noise] * dimensions + [self.velocity_noise] * dimensions)


class Estimator(TargetModel, Actor, ABC):
    """Base of all estimators: one prediction and fusion at each trigger.  Write ``step``.

    The estimate has the time of the trigger, and each measurement is fused at its own time, however late it comes, if
    that is not more than ``max_delay``; older ones are counted at ``too_late``.  For a late one, ``step`` is called
    again with the state of that time, and for all times since: it must give the same result for the same arguments,
    change none of them, and draw random numbers from ``stream_of_step``.

    A measurement that comes between two triggers waits for the next one.  Before the first measurement, or the first
    trigger, the filter holds its prior.  A measurement that is not finite is ignored, as is an update with a result
    that is not finite.
    """

    trigger = InputPort(object, doc="predict to the present time, fuse, and send the estimate")
    measurements = InputPort(
        Measurement, multi=True, required=False, triggers=False, doc="measurements of all robots, including this one"
    )
    estimate = OutputPort(Estimate, doc="the target's state (x, y, vx, vy) after fusion")
    too_late = OutputPort(
        int, doc="number of measurements so far that came more than max_delay late; sent with each of them"
    )

    period = Parameter(float, 0.1, unit="s", above=0, doc="the time over which the process noise was measured")
    prior_mean = array_parameter((4,), (10.0, 0.0, 0.0, 0.0), doc="first guess of (x, y, vx, vy) in m and m/s")
    prior_variance = array_parameter((4,), (400.0, 400.0, 4.0, 4.0), min=0, doc="its variances, in m^2 and m^2/s^2")
    max_delay = Parameter(float, 2.0, unit="s", min=0, max=1e9, doc="largest age of a measurement that is still fused")

    def initialize(self) -> None:
        from .numerics.warm_up import compile_kernels

        compile_kernels()
        self._process_noise = self.process_noise()
        self._history = History(self.prior(), _order, self.max_delay)
        self._step_at = 0  # ns

    def fire(self) -> None:
        now, history = self.tag.time, self._history
        if history.take([each for each in received(self.measurements) if each.finite], now):
            self.too_late.send(history.too_late)
        if not self.trigger.present:
            return
        state, fused = history.run(now, self._advance)
        history.forget(now)
        self.estimate.send(self.estimate_of(state, to_seconds(now), tuple(sorted(fused))))

    def _advance(self, before: Any, elapsed: float, step: Step) -> tuple[Any, bool]:
        self._step_at = step.time
        return self.step(before, elapsed, step.data)

    def prior(self) -> Any:
        """The state of the filter before the first step; mean and covariance unless all three hooks say otherwise."""
        return np.array(self.prior_mean), np.diag(self.prior_variance)

    @abstractmethod
    def step(self, state: Any, elapsed: float, measurements: list[Measurement]) -> tuple[Any, bool]:
        """The state of the filter ``elapsed`` seconds (0 at the first trigger) later; whether anything was fused."""

    def estimate_of(self, state: Any, time: float, sources: tuple[str, ...]) -> Estimate:
        """The token to send for a state."""
        mean, covariance = state
        return Estimate(mean, covariance, time, sources)

    def motion(self, elapsed: float) -> tuple[Array, Array]:
        """Eq. (1): the transition (2 d, 2 d) of the target over a time (s), and the covariance that it gains."""
        from .numerics.ukf import constant_velocity

        return constant_velocity(elapsed), self._noise_over(elapsed)

    def stream_of_step(self, purpose: str) -> Stream:
        """The random numbers of the present step: the same ones when it is repeated for a late measurement."""
        return self.context.streams.of(self.path, f"{purpose} at {self._step_at}")

    def _noise_over(self, elapsed: float) -> Array:
        """The process noise of a number of seconds."""
        return self._process_noise * (elapsed / self.period)


def _order(measurement: Measurement) -> Any:
    each = measurement
    return each.robot, each.kind, each.observer.tolist(), each.value.tolist(), each.along, each.across


class KalmanEstimator(Estimator):
    """The common part of filters that hold a normal distribution."""

    noise_direction = Parameter(
        str,
        EXPECTED,
        choices=(EXPECTED, PREDICTED),
        doc="the noise ellipse is averaged over the directions that the prediction allows, or turned along its mean",
    )

    def initialize(self) -> None:
        from .numerics import ukf

        super().initialize()
        self._kinds = {RANGE: float(ukf.RANGE), RELATIVE_POSITION: float(ukf.RELATIVE_POSITION)}
        # Kept, as executing an import takes 1 us each time.
        self._predict, self._sigma_points, self._fuse_images = ukf.predict, ukf.sigma_points, ukf.fuse_images
        self._model = lru_cache(8)(self.motion)
        self._averaged = self.noise_direction == EXPECTED

    def step(self, state: State, elapsed: float, measurements: list[Measurement]) -> tuple[State, bool]:
        """Predict, and fuse the measurements of any sensors, all at once."""
        mean, covariance = self._predict(*state, *self._model(elapsed))
        if not measurements:
            return (mean, covariance), False
        points, weights = self._sigma_points(mean, covariance, self.kappa)
        images, observed, noise = self._images(mean, points, weights, measurements)
        mean, covariance, fused = self._fuse_images(mean, covariance, points, weights, images, observed, noise)
        return (mean, covariance), fused

    def _images(
        self, mean: Array, points: Array, weights: Array, measurements: list[Measurement]
    ) -> tuple[Array, Array, Array]:
        """What is measured at each of the sigma points (M, rows) and in truth (rows,), and the covariance of the noise.

        Both are differences to what is measured at the mean, so that angles near a half turn do no harm.
        """
        rows = [self._rows_of(floats(mean), points, each) for each in measurements]
        errors = [list(map(float, each.innovation(floats(mean)))) for each in measurements]
        noise, at = np.zeros((size := sum(map(len, errors)), size)), 0
        for each, error in zip(measurements, errors, strict=True):
            where = slice(at, at + len(error))
            noise[where, where] = self._noise_of(each, mean, points, weights)
            at += len(error)
        return np.hstack(rows), np.concatenate(errors), noise

    def _noise_of(self, measurement: Measurement, mean: Array, points: Array, weights: Array) -> Array:
        """The covariance of a measurement, averaged over the sigma points, or at the mean."""
        total: Any = 0.0
        for point, weight in zip(points, floats(weights), strict=True) if self._averaged else [(mean, 1.0)]:
            total = total + weight * np.array(measurement.noise(floats(point)))
        return np.array(total)

    def _rows_of(self, mean: Sequence[float], points: Array, measurement: Measurement) -> Array:
        """What a sensor measures at each point (M, k), less what it does at the mean."""
        there, sensor = measurement.expected(mean), measurement.sensor
        each = [sensor.difference(measurement.expected(floats(point)), there) for point in points]
        return np.array(each, dtype=float)

    def _rows(self, measurements: list[Measurement]) -> Array:
        """The measurements (m, 3 + 2 d) as the kernels take them; an observer in the plane is on the ground."""
        rows, d = [], 2
        for each in measurements:
            d = max(d, len(each.observer))
        for each in measurements:
            place, value = floats(each.observer), floats(each.value)
            vectors = (*place, *_NOTHING[: d - len(place)], *value, *_NOTHING[: d - len(value)])
            rows.append(array_of((self._kinds[each.kind], *vectors, each.along, each.across)))
        return stacked(rows, 3 + 2 * d)


class UnscentedEstimator(KalmanEstimator):
    """The unscented Kalman filter of the paper; fuses all measurements of one time at once.

    The estimate has the time of the trigger, and each measurement is fused at its own time.  For a late one, the filter
    returns to that time and runs again from there, so that later estimates are as if it had come in time; a measurement
    more than ``max_delay`` late is not fused, but counted at ``too_late``.

    Relative positions and ranges are fused by compiled kernels, an ``Observation`` of another sensor in Python.
    """

    def initialize(self) -> None:
        from .numerics import ukf

        super().initialize()
        self._move_and_fuse = ukf.predict_and_fuse

    def step(self, state: State, elapsed: float, measurements: list[Measurement]) -> tuple[State, bool]:
        for each in measurements:
            if type(each) is not Measurement:
                return super().step(state, elapsed, measurements)
        return self._step(state, elapsed, measurements)

    def _step(self, state: State, elapsed: float, measurements: list[Measurement]) -> tuple[State, bool]:
        model, rows = self._model(elapsed), self._rows(measurements)  # the model is nearly always the same
        mean, covariance, fused = self._move_and_fuse(*state, *model, self.kappa, rows, self._averaged)
        return (mean, covariance), fused


class ExtendedEstimator(KalmanEstimator):
    """The extended Kalman filter: what a sensor measures is a linear function, with its slope at the prediction.

    Slopes are central differences.
    """

    def _rows_of(self, mean: Sequence[float], points: Array, measurement: Measurement) -> Array:
        found = np.zeros((len(points), 1))
        for j, change in enumerate(slopes(measurement, mean)):
            found = found + (points[:, j] - mean[j])[:, np.newaxis] * change
        return found


def slopes(measurement: Measurement, mean: Sequence[float]) -> list[Array]:
    """How what a sensor measures changes with each number of the target's state: central differences."""
    found = []
    for j in range(len(mean)):
        step = 1e-6 * max(1.0, abs(mean[j]))
        sides = [[*mean[:j], mean[j] + sign * step, *mean[j + 1 :]] for sign in (1.0, -1.0)]
        change = measurement.sensor.difference(*map(measurement.expected, sides))
        found.append(np.array(change, dtype=float) / (2.0 * step))
    return found
