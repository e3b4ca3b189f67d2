"""A particle filter of one's own."""

from typing import Any

import numpy as np

from epicycle.actors import Estimator, Parameter, SampledEstimate


class OwnParticles(Estimator):
    """Many guesses of the target's state, each as likely as what was measured makes it."""

    particles = Parameter(int, 200, min=10, doc="how many")
    told = Parameter(int, 20, min=1, doc="how many of them the estimate tells")

    def prior(self) -> Any:
        draw = self.random_stream("prior").standard_normal
        deviations = np.sqrt(self.prior_variance)
        return self.prior_mean + deviations * np.array([[draw() for _ in range(4)] for _ in range(self.particles)])

    def step(self, state: Any, elapsed: float, measurements: Any) -> Any:
        draw = self.stream_of_step("motion").standard_normal
        if elapsed > 0.0:
            transition, gained = self.motion(elapsed)
            noise = np.sqrt(np.diag(gained)) * np.array([[draw() for _ in range(4)] for _ in state])
            state = state @ transition.T + noise
        if not measurements:
            return state, False
        logs = np.zeros(len(state))
        for measured in measurements:
            for row, point in enumerate(state.tolist()):
                error, covariance = np.array(measured.innovation(point)), np.array(measured.noise(point))
                logs[row] -= 0.5 * error @ np.linalg.solve(covariance, error)
        weights = np.exp(logs - logs.max())
        weights /= weights.sum()
        start = self.stream_of_step("choice").random()
        rows = np.searchsorted(np.cumsum(weights), (start + np.arange(len(state))) / len(state))
        return state[np.minimum(rows, len(state) - 1)], True

    def estimate_of(self, state: Any, time: float, sources: Any) -> SampledEstimate:
        samples = state[:: max(1, len(state) // self.told)]
        return SampledEstimate(
            state.mean(axis=0),
            np.cov(state.T) + 1e-9 * np.eye(4),
            time,
            sources,
            samples=samples,
            weights=np.full(len(samples), 1.0 / len(samples)),
        )
