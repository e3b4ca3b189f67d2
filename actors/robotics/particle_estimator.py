"""A particle filter."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from ..core import Parameter, Stream
from ..core.elementary import exp, total
from .arrays import Array, floats
from .estimator import Estimator
from .messages import Measurement, SampledEstimate
from .sensor_models import log_density, root_of

Particles: TypeAlias = tuple[Array, Array]  # (M, 4) states and (M,) weights


class ParticleEstimator(Estimator):
    """A bootstrap particle filter: any belief, and any sensor.

    Particles move by eq. (1), each with noise of its own, and are weighed by the density of what was measured.  When
    few of them have all the weight (an effective number below half), they are drawn again.  The estimate has their mean
    and covariance, and some of them as ``samples``, for objectives such as ``Inform``.
    Source: S. Thrun, W. Burgard and D. Fox, Probabilistic Robotics, 2005, section 4.3.
    """

    particles = Parameter(int, 500, min=10, max=100_000, doc="number of particles")
    samples = Parameter(int, 32, min=1, max=1000, doc="number of them that the estimate tells")

    def prior(self) -> Particles:
        draw = self.random_stream("prior").standard_normal
        root = np.sqrt(self.prior_variance)
        states = [[m + s * draw() for m, s in zip(self.prior_mean, root, strict=True)] for _ in range(self.particles)]
        return np.array(states), np.full(self.particles, 1.0 / self.particles)

    def step(self, state: Particles, elapsed: float, measurements: list[Measurement]) -> tuple[Particles, bool]:
        states, weights = state
        if elapsed > 0.0:
            states = self._moved(states, elapsed)
        if not measurements:
            return (states, weights), False
        logs = []
        for point, weight in zip(map(floats, states), floats(weights), strict=True):
            logs.append(0.0 if weight > 0.0 else -np.inf)
            for each in measurements:
                logs[-1] += log_density(each.innovation(point), each.noise(point))
        most = max(logs)
        if not most > -np.inf:
            return (states, weights), False
        grown = np.array([weight * exp(each - most) for weight, each in zip(floats(weights), logs, strict=True)])
        weights = grown / _sum(grown)
        if _sum(weights * weights) * len(weights) > 2.0:
            chosen = _chosen(weights, len(weights), self.stream_of_step("choice"))
            states, weights = states[chosen], np.full(len(weights), 1.0 / len(weights))
        return (states, weights), True

    def _moved(self, states: Array, elapsed: float) -> Array:
        transition, gained = (each.tolist() for each in self.motion(elapsed))
        root, draw = root_of(gained), self.stream_of_step("motion").standard_normal
        moved = []
        for state in states.tolist():
            drawn = [draw() for _ in state]
            moved.append([_dot(row, state) + _dot(spread, drawn) for row, spread in zip(transition, root, strict=True)])
        return np.array(moved)

    def estimate_of(self, state: Particles, time: float, sources: tuple[str, ...]) -> SampledEstimate:
        states, weights = state
        mean = [_sum(weights * column) for column in states.T]
        apart = (states - mean).T
        covariance = [[_sum(weights * a * b) for b in apart] for a in apart]
        chosen = _chosen(weights, self.samples, None)
        share = np.full(self.samples, 1.0 / self.samples)
        return SampledEstimate(mean, covariance, time, sources, samples=states[chosen], weights=share)


def _chosen(weights: Array, count: int, stream: Stream | None) -> list[int]:
    """Rows, each about as often as its weight says, at equal distances from a random start."""
    first, reached, row, chosen = 0.5 if stream is None else stream.random(), 0.0, -1, []
    each = floats(weights)
    for k in range(count):
        while reached <= (first + k) / count and row < len(each) - 1:
            row += 1
            reached += each[row]
        chosen.append(max(row, 0))
    return chosen


def _dot(a: list[float], b: list[float]) -> float:
    product: float = total(x * y for x, y in zip(a, b, strict=True))
    return product


def _sum(values: Array) -> float:
    """In index order, which is the same on every machine."""
    found: float = total(floats(values))
    return found
