"""Compiles all kernels at once, so that the wait comes before time starts and can be announced."""

from __future__ import annotations

import functools
import gc
import logging
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from .barrier import solve
from .compiled import IS_PYTHON, IS_READY, LEDGER
from .definitions import INFORM
from .horizon import HorizonProblem
from .kept import folder, mark
from .mutual_information import pairwise_distance
from .reachability import expected_target, peer_tubes, standing_plan
from .ukf import constant_velocity, fuse_images, predict_and_fuse, sigma_points

_LOGGER = logging.getLogger("epicycle")
_PATIENCE = 1.0  # s before the wait is explained; loading the cached kernels is quicker
_STEPS = 3


@functools.cache
def compile_kernels(dimensions: int = 2) -> None:
    """Call every kernel of a run with small arrays; only the first call in a process does something.

    All take any number of dimensions but the solver, which is compiled for the plane and for space by itself.
    """
    _prepare("the numeric kernels", functools.partial(_call_every_kernel, dimensions))


@functools.cache
def compile_tracking() -> None:
    """The same for the kernels of a tracker, which other models do not need."""
    compile_kernels()
    _prepare("the kernels of the tracker", _call_tracking)


@functools.cache
def compile_retreats() -> None:
    """The same for the kernels of a main robot that keeps a retreat open, and of its filter."""
    compile_kernels()
    _prepare("the kernels of the safe robot", _call_retreats)


def compile_now() -> None:
    """Compile the kernels of the plane for all later processes: ``python -m`` this module."""
    LEDGER.close()
    compile_kernels()


def _prepare(what: str, call: Callable[[], None]) -> None:
    """Compile some kernels before time starts, or as soon as Python has run kernels for long enough."""

    def compile_them() -> None:
        with _announced(f"compiling {what} (once, about 20 s) ..."):
            call()

    if IS_PYTHON:
        return
    if IS_READY or not LEDGER.allows():
        compile_them()
    else:
        LEDGER.prepared.append(compile_them)


@contextmanager
def _announced(message: str) -> Iterator[None]:
    """What is compiled here is announced if it takes long."""
    notice = threading.Timer(_PATIENCE, _LOGGER.info, (message,))
    notice.daemon = True
    notice.start()
    was_enabled = gc.isenabled()
    gc.disable()  # numba makes millions of objects, and garbage collection takes a sixth of the time
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()
        notice.cancel()


def _call_every_kernel(dimensions: int) -> None:
    with _others_meanwhile():
        _call_solver(dimensions)
    call_others()
    mark("compiled")


@contextmanager
def _others_meanwhile() -> Iterator[None]:
    """If nothing is compiled yet, a second process compiles everything except the solver, which takes longest.

    Both write to the same cache, each the code of kernels that the other does not need.  If the second one fails,
    everything is compiled here.
    """
    if (os.cpu_count() or 1) == 1 or any(folder().rglob("*.nbc")):
        yield
        return
    program = f"from {__spec__.name} import LEDGER, call_others; LEDGER.close(); call_others()"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    null = subprocess.DEVNULL
    try:
        other = subprocess.Popen([sys.executable, "-c", program], env=environment, stdin=null, stdout=null, stderr=null)
    except OSError:  # there may be no such program if Python is embedded in another one
        yield
        return
    with other:  # and wait for it
        yield


def _call_solver(d: int) -> None:
    zeros, steps = np.zeros, _STEPS
    # Plans that solve it need only one Newton step, and compile everything.
    problem = HorizonProblem(
        0.1, zeros(d), zeros(d), 1.0, 1.0, zeros((steps, d)), np.ones(steps), 1.0, 1.0, zeros((1, steps, d)) + 100.0,
        zeros((1, steps, d * (d + 1) // 2)), zeros((1, steps, d)) + 200.0, zeros((1, steps)), INFORM, zeros((1, d)),
        zeros((9, d)), np.ones(9), zeros((9, 9)), 1.0, 1.0, 1.0, 1.0, 1.0,
    )  # fmt: skip
    solve(problem, zeros((2, steps, d)))


def call_others() -> None:
    """Call every kernel except the solver."""
    period, zero, ones = 0.1, np.zeros(2), np.ones(_STEPS)
    mean, covariance, _ = predict_and_fuse(
        np.zeros(4), np.eye(4), constant_velocity(period), np.eye(4), 0.0, np.zeros((1, 7)), True
    )
    points, weights = sigma_points(mean, covariance, 0.0)
    fuse_images(mean, covariance, points, weights, points[:, :1].copy(), np.zeros(1), np.eye(1))
    for token in (mean, covariance):
        token.setflags(write=False)
    _, _, points, _ = expected_target(mean, covariance, np.eye(4), False, 0.0, period, 0.0, _STEPS, 2)
    standing_plan(zero, zero, np.zeros((_STEPS, 2)), 0.0, ones, zero, 0.0, 1.0, period)
    peer_mean, _ = peer_tubes(np.zeros((1, 7)), 0.0, period, ones, 0.4, 1.0, 1.0, 2)
    pairwise_distance(points, peer_mean, 1.0)


def _call_tracking() -> None:
    from .association import duplicates, fuse_scan, new_track, predict_tracks, separations

    means, covariances, existence = predict_tracks(
        np.zeros((1, 4)), np.eye(4).reshape((1, 4, 4)), np.ones(1), np.eye(4), 0.1, 1.0
    )
    detection = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0])
    fuse_scan(means, covariances, existence, 0.0, detection, detection.reshape((1, 7)), 0.9, 1.0, 10.0, 16.0, True)
    new_track(detection, 1.0)
    duplicates(means, covariances, 1.0)
    separations(means, covariances, 1)


def _call_retreats() -> None:
    from . import lines_of_sight, retreat
    from .reachability import propagate
    from .ukf import predict

    mean, covariance, zero, one = np.zeros(4), np.eye(4), np.zeros(2), np.array([[1.0, 0.0]])
    lines_of_sight.predict_and_fuse(mean, covariance, covariance, covariance, 0.0, np.zeros((1, 7)), 4.0)
    predict(mean, covariance, covariance, covariance)
    propagate(mean, covariance, covariance, covariance, _STEPS, 2)
    reaches = retreat.support(one, mean, covariance, 0.0, 1.0, 1.0)
    retreat.best_retreat(one, reaches, zero, zero, zero, 1.0, 2.0, 1.0, 0.1)
    retreat.kept_distance(1.0, 0.0, 0.0, zero, zero, zero, 1.0, 2.0, 1.0, 0.1)


if __name__ == "__main__":
    compile_now()
