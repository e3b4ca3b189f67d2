"""Estimates of the target from all robots' measurements, and what they assume of its motion, eq. (1)."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, TypeAlias

import numpy as np

from ..core import Actor, Configurable, InputPort, OutputPort, Parameter, array_parameter, to_seconds
from .arrays import Array, array_of, floats, stacked
from .history import History, Step
from .messages import RANGE, RELATIVE_POSITION, Estimate, Measurement
from .receiving import received

EXPECTED, PREDICTED = "expected", "predicted"
_NOTHING = 0.0, 0.0
State: TypeAlias = tuple[Array, Array]  # of a filter: mean and covariance, never modified


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


class _Estimator(TargetModel, Actor):
    """The common part of all estimators: the model of eq. (1), and one prediction and fusion at each trigger.

    The estimate has the time of the trigger, and each measurement is fused at its own time, however late it comes
    (``History``), if that is not more than ``max_delay``; older ones are counted at ``too_late``.

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
        self._kinds = {RANGE: float(ukf.RANGE), RELATIVE_POSITION: float(ukf.RELATIVE_POSITION)}
        self._process_noise = self.process_noise()
        prior: State = np.array(self.prior_mean), np.diag(self.prior_variance)
        self._history = History(prior, _order, self.max_delay)

    def fire(self) -> None:
        now, history = self.tag.time, self._history
        if history.take([each for each in received(self.measurements) if each.finite], now):
            self.too_late.send(history.too_late)
        if not self.trigger.present:
            return
        state, fused = history.run(now, self._advance)
        history.forget(now)
        self.estimate.send(Estimate(*self._told(state), to_seconds(now), tuple(sorted(fused))))

    def _advance(self, before: State, elapsed: float, step: Step) -> tuple[State, bool]:
        return self._step(before, elapsed, step.data)

    def _step(self, before: State, elapsed: float, measurements: list[Measurement]) -> tuple[State, bool]:
        """The state of the filter ``elapsed`` seconds (0 at the first trigger) later; whether anything was fused."""
        raise NotImplementedError

    def _told(self, state: State) -> State:
        """The estimate to send for a state."""
        return state

    def _noise_over(self, elapsed: float) -> Array:
        """The process noise of a number of seconds."""
        return self._process_noise * (elapsed / self.period)

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


def _order(measurement: Measurement) -> Any:
    each = measurement
    return each.robot, each.kind, each.observer.tolist(), each.value.tolist(), each.along, each.across


class UnscentedEstimator(_Estimator):
    """The unscented Kalman filter of the paper, compiled; fuses all measurements of one time at once.

    The estimate has the time of the trigger, and each measurement is fused at its own time.  For a late one, the filter
    returns to that time and runs again from there, so that later estimates are as if it had come in time; a measurement
    more than ``max_delay`` late is not fused, but counted at ``too_late``.
    """

    def initialize(self) -> None:
        from .numerics import ukf

        super().initialize()
        self._move_and_fuse = ukf.predict_and_fuse  # kept, as executing an import takes 1 us each time
        self._model = lru_cache(8)(lambda elapsed: (ukf.constant_velocity(elapsed), self._noise_over(elapsed)))
        self._averaged = self.noise_direction == EXPECTED

    def _step(self, before: State, elapsed: float, measurements: list[Measurement]) -> tuple[State, bool]:
        model, rows = self._model(elapsed), self._rows(measurements)  # the model is nearly always the same
        mean, covariance, fused = self._move_and_fuse(*before, *model, self.kappa, rows, self._averaged)
        return (mean, covariance), fused
