"""Compiles all kernels at once, so that the wait comes before time starts and can be announced."""

from __future__ import annotations

import functools
import logging
import threading

import numpy as np

from .barrier import solve
from .horizon import HorizonProblem
from .reachability import expected_target, peer_tubes, standing_plan
from .ukf import constant_velocity, predict_and_fuse

_LOGGER = logging.getLogger("epicycle")
_PATIENCE = 1.0  # s before the wait is explained; loading the cached kernels is quicker


@functools.cache
def compile_kernels() -> None:
    """Call every kernel of a run with small arrays; the first call of a process does it, later ones do nothing."""
    message = "compiling the numeric kernels (once, about 20 s) ..."
    notice = threading.Timer(_PATIENCE, _LOGGER.info, (message,))
    notice.daemon = True
    notice.start()
    try:
        _call_every_kernel()
    finally:
        notice.cancel()


def _call_every_kernel() -> None:
    steps, period = 3, 0.1
    model = constant_velocity(period), np.eye(4)
    mean, covariance, _ = predict_and_fuse(np.zeros(4), np.eye(4), *model, 0.0, np.zeros((1, 7)), True)
    for token in (mean, covariance):
        token.setflags(write=False)
    means, covariances, sigma_positions, weights = expected_target(
        mean, covariance, np.eye(4), False, 0.0, period, 0.0, steps
    )
    controls, zero, ones = np.zeros((steps, 2)), np.zeros(2), np.ones(steps)
    centre, radius, starts = standing_plan(zero, zero, controls, 0.0, ones, zero, 0.0, 1.0, period)
    peer_mean, peer_distance = peer_tubes(np.zeros((1, 6)), 0.0, period, ones, 0.4, 1.0, 1.0)
    seen, heard = (means + 100.0, covariances), (peer_mean + 200.0, peer_distance)
    posed = HorizonProblem(period, zero, zero, 1.0, 1.0, centre, radius, 1.0, 1.0, *seen, *heard)
    solve(posed.to_inform(sigma_positions, weights, peer_mean, 1.0, 1.0, 1.0).to_reach(np.ones(2)), starts)
