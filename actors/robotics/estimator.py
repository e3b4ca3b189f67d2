"""Estimates of the target from all robots' measurements, and what they assume of its motion, eq. (1)."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass
from functools import lru_cache
from operator import attrgetter
from typing import Any, TypeAlias

import numpy as np

from ..core import Actor, Configurable, InputPort, OutputPort, Parameter, array_parameter, to_nanoseconds, to_seconds
from .arrays import Array, array_of, floats, stacked
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


@dataclass(slots=True)
class _Step:
    """A step of the filter at one time, repeated when a late measurement belongs there or earlier."""

    time: int  # ns
    measurements: list[Measurement]
    after: Any = None  # the state of the filter then


class _Estimator(TargetModel, Actor):
    """The common part of all estimators: the model of eq. (1), and one prediction and fusion at each trigger.

    The estimate has the time of the trigger, and each measurement is fused at its own time.  A late measurement is
    inserted at its place among the past steps, and the filter runs again from there: later estimates are, to the bit,
    those of a filter that got it in time.  (Formulas for such out-of-sequence measurements, as by Bar-Shalom, IEEE
    Trans. Aerosp. Electron. Syst. 38, 2002, spare the second run and are exact for linear models.)  Steps are kept for
    ``max_delay``; older measurements are not fused, but counted at ``too_late``.

    A measurement that comes between two triggers waits for the next one; one from the future, from a wrong clock, is
    treated as made now.  A copy of a fused measurement has no effect.  Before the first measurement, or the first
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
        self._waiting: list[Measurement] = []  # for the next trigger
        self._too_late = 0
        self._steps: list[
            _Step
        ] = []  # of the last ``max_delay``, and the state of the filter before them, with its time
        self._before: State = np.array(self.prior_mean), np.diag(self.prior_variance)
        self._before_at: int | None = None  # None: it is the prior, at any time

    def fire(self) -> None:
        now = self.tag.time
        self._take(now - to_nanoseconds(self.max_delay))
        if not self.trigger.present:
            return
        state, fused = self._catch_up(self._waiting, now)
        self._waiting = []
        self._forget(now - to_nanoseconds(self.max_delay))
        self.estimate.send(Estimate(*self._told(state), to_seconds(now), tuple(sorted(fused))))

    def _take(self, earliest: int) -> None:
        """Keep new measurements for the next trigger, unless they are older than ``earliest``."""
        come = [*self._waiting, *(each for each in received(self.measurements) if each.finite)]
        self._waiting = [each for each in come if to_nanoseconds(each.time) >= earliest]
        if len(self._waiting) < len(come):
            self._too_late += len(come) - len(self._waiting)
            self.too_late.send(self._too_late)

    def _catch_up(self, measurements: list[Measurement], now: int) -> tuple[State, set[str]]:
        """Insert measurements at their times, and bring the filter to the present; also returns the robots that were
        heard."""
        steps = self._steps
        first = self._place_of(now)  # of the first changed step
        new: list[tuple[_Step, Measurement]] = []
        for each in measurements:
            place = self._place_of(min(to_nanoseconds(each.time), now))
            step = steps[place]
            if not any(known.robot == each.robot and _order(known) == _order(each) for known in step.measurements):
                step.measurements.append(each)
                new.append((step, each))
                first = min(first, place)
        state, before = (steps[first - 1].after, steps[first - 1].time) if first else (self._before, self._before_at)
        fused = set()
        for step in steps[first:]:
            elapsed = 0.0 if before is None else to_seconds(step.time - before)
            # Sorted, so that the order of arrival has no influence, not even on the last bit.
            robots = {each.robot for each in step.measurements}
            step.measurements.sort(key=_robot if len(robots) == len(step.measurements) else _order)
            state, is_fused = self._step(state, elapsed, step.measurements)
            if is_fused:
                fused |= {each.robot for where, each in new if where is step}
            step.after, before = state, step.time
        return state, fused

    def _place_of(self, time: int) -> int:
        """The index of the step at that time, which may be new."""
        steps = self._steps
        place = len(steps)
        if steps and time <= steps[-1].time:  # usually the last one, or a new one
            place = place - 1 if time == steps[-1].time else bisect_left(steps, time, key=_time)
        if place == len(steps) or steps[place].time != time:
            steps.insert(place, _Step(time, []))
        return place

    def _forget(self, earliest: int) -> None:
        """Forget the steps before a time, which no measurement can change any longer."""
        if self._steps[0].time < earliest:  # there is at least the present one
            count = bisect_left(self._steps, earliest, key=_time)
            last = self._steps[count - 1]
            self._before, self._before_at = last.after, last.time
            del self._steps[:count]

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


_time, _robot = attrgetter("time"), attrgetter("robot")


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
