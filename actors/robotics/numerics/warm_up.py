"""Compiles all kernels at once, so that the wait comes before time starts and can be announced."""

from __future__ import annotations

import functools
import logging
import threading

import numpy as np

from .barrier import solve
from .constraints import violations
from .horizon import REACH_GOAL, HorizonProblem, trajectory
from .mutual_information import pairwise_distance
from .reachability import planned_positions, propagate, tube_radius
from .ukf import constant_velocity, measurement_noise, predict, sigma_points, update

_LOGGER = logging.getLogger("epicycle")
_PATIENCE = 1.0  # s before the wait is explained; loading the cached kernels is quicker


@functools.cache
def compile_kernels() -> None:
    """Call every kernel with small arrays; the first call of a process does it, later ones do nothing."""
    message = "compiling the numeric kernels (once, about 30 s) ..."
    notice = threading.Timer(_PATIENCE, _LOGGER.info, (message,))
    notice.daemon = True
    notice.start()
    try:
        _call_every_kernel()
    finally:
        notice.cancel()


def _call_every_kernel() -> None:
    steps, period = 3, 0.1
    transition = constant_velocity(period)
    mean, covariance = predict(np.zeros(4), np.eye(4), transition, np.eye(4))
    one, pair = np.zeros(1), np.ones((1, 2))
    points, weights = sigma_points(mean, covariance, 0.0)
    noises = measurement_noise(points, weights, one, pair, pair)
    mean, covariance = update(mean, covariance, 0.0, one, pair, pair, noises)
    sigma_positions = np.ascontiguousarray(points[:, :2])
    means, covariances = propagate(mean, covariance, transition, np.zeros((4, 4)), steps)
    radius = tube_radius(0.2, 0.4, 1.0, steps)
    controls = np.zeros((steps, 2))
    planned_positions(np.zeros(2), np.zeros(2), controls, period, 1, steps)
    problem = HorizonProblem(
        period=period,
        position=np.zeros(2),
        velocity=np.zeros(2),
        max_speed=1.0,
        max_acceleration=1.0,
        tube_centre=trajectory(np.zeros(2), np.zeros(2), controls, period, steps),
        tube_radius=radius,
        safe_distance=1.0,
        margin=1.0,
        obstacle_mean=means[np.newaxis] + 100.0,
        obstacle_covariance=covariances[np.newaxis].copy(),
        peer_mean=np.full((1, steps, 2), 200.0),
        peer_distance=np.ones((1, steps)),
        objective=REACH_GOAL,
        goal=np.ones(2),
        sigma_positions=sigma_positions,
        sigma_weights=weights,
        others_distance=pairwise_distance(sigma_positions, pair, 1.0),
        measurement_variance=1.0,
        range_penalty=1.0,
        measurement_range=1.0,
    )
    violations(problem, controls)
    solve(problem, controls[np.newaxis].copy())
