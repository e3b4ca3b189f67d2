"""A filter's update in the frames of the true lines of sight, linearised where the target is found to be.

The noise of a relative position has its deviations along and across the true line of sight.  ``ukf`` turns that ellipse
as the prediction says; if that is wrong by some degrees, the large error leaks into the small one.  Here, the function
that is fused is the noise itself, given where the target would be: its deviations are the sensor's, wherever that is.
It is linearised by regression over sigma points (Garcia-Fernandez et al., Posterior linearization filter, IEEE Trans.
Signal Process. 63, 2015).
"""

from __future__ import annotations

import numpy as np

from ...core.elementary import hypot
from .compiled import Array, Row, Table, inner, kernel
from .ukf import (
    RANGE,
    _add_congruence,
    _add_products,
    _finite,
    _fuse,
    _gain,
    _symmetrise,
    centred,
    measurement_noise,
    predict,
    rows_of,
    sigma_points,
)

_ROUNDS = 2  # linearisations after the update of ``ukf``, which is the first guess


@inner
def noises_at(points: Array, measurements: Array) -> Array:
    """The noises (M, rows) that measurements (m, 7) have if the target is at each of ``points`` (M, n).

    With the target at x and the robot at r, a relative position is z = (|x - r| + a) n + b t, where n is the direction
    from r to x, and t is across it: the noise is a = n . z - |x - r| and b = t . z.  That of a range is z - |x - r|.
    """
    found = np.empty((points.shape[0], rows_of(measurements)))
    row = 0
    for m in range(measurements.shape[0]):
        is_range, zx, zy = measurements[m, 0] == RANGE, measurements[m, 3], measurements[m, 4]
        for i in range(points.shape[0]):
            dx, dy = points[i, 0] - measurements[m, 1], points[i, 1] - measurements[m, 2]
            length = hypot(dx, dy)
            nx, ny = (dx / length, dy / length) if length > 0.0 else (1.0, 0.0)
            found[i, row] = (zx if is_range else nx * zx + ny * zy) - length
            if not is_range:
                found[i, row + 1] = nx * zy - ny * zx
        row += 1 if is_range else 2
    return found


@inner
def _linearised(about: Array, spread: Array, kappa: float, measurements: Array) -> tuple[Array, Array, Array]:
    """The noises as a linear function of the state about a point: value there, slope, and the covariance of the rest.

    The rest is what the slope leaves over sigma points of covariance ``spread``, and the noise of the sensors.
    """
    points, weights = sigma_points(about, spread, kappa)
    images = noises_at(points, measurements)
    rows, size = images.shape[1], about.shape[0]
    value, slope, rest = centred(images, weights), np.zeros((rows, size)), np.zeros((rows, rows))
    for i in range(points.shape[0]):
        for j in range(size):
            points[i, j] -= about[j]
    _add_products(slope, weights, images, points)
    slope = _gain(spread, slope)
    for i in range(points.shape[0]):
        for k in range(rows):
            for j in range(size):
                images[i, k] -= slope[k, j] * points[i, j]
    _add_products(rest, weights, images, images)
    row = 0
    for m in range(measurements.shape[0]):
        for c in range(1 if measurements[m, 0] == RANGE else 2):
            rest[row, row] += measurements[m, 5 + c] * measurements[m, 5 + c]
            row += 1
    return value, slope, rest


@inner
def _fused_about(
    about: Array,
    spread: Array,
    mean: Array,
    covariance: Array,
    kappa: float,
    measurements: Array,
    degrees_of_freedom: float,
) -> tuple[Array, Array]:
    """The state after an update of (mean, covariance) with the noises as they are about a point.

    The covariance is widened by (nu + d^2) / (nu + rows), where nu is ``degrees_of_freedom``, if the squared normalised
    innovation d^2 is more than the ``rows`` that are expected.
    """
    value, slope, rest = _linearised(about, spread, kappa, measurements)
    rows, size = slope.shape
    innovation, reach, expected = rest.copy(), np.zeros((size, rows)), np.zeros((1, rows))
    _add_congruence(innovation, np.zeros((rows, size)), slope, covariance)
    for k in range(rows):
        expected[0, k] = value[k]
        for j in range(size):
            expected[0, k] += slope[k, j] * (mean[j] - about[j])
            for i in range(size):
                reach[i, k] += covariance[i, j] * slope[k, j]
    gain, weighted = _gain(innovation, reach), _gain(innovation, expected)
    then, kept, after, surprise = mean.copy(), np.zeros((size, size)), np.zeros((size, size)), 0.0
    for k in range(rows):
        surprise += weighted[0, k] * expected[0, k]
    for i in range(size):
        kept[i, i] = 1.0
        for k in range(rows):
            then[i] -= gain[i, k] * expected[0, k]
            for j in range(size):
                kept[i, j] -= gain[i, k] * slope[k, j]
    # (1 - K H) P (1 - K H)^T + K R K^T, which rounding cannot make indefinite.
    _add_congruence(after, np.zeros((size, size)), kept, covariance)
    _add_congruence(after, np.zeros((size, rows)), gain, rest)
    _symmetrise(after)
    wider = max(1.0, (degrees_of_freedom + surprise) / (degrees_of_freedom + rows))
    for i in range(size):
        for j in range(size):
            after[i, j] *= wider
    return then, after


@kernel
def predict_and_fuse(
    mean: Row, covariance: Table, transition: Table, process_noise: Table, kappa: float, measurements: Table,
    degrees_of_freedom: float,
) -> tuple[Row, Table, bool]:  # fmt: skip
    """``ukf.predict``, then an update with measurements (m, 7), and whether anything was fused.

    If the result would not be finite, the prediction is kept.
    """
    mean, covariance = predict(mean, covariance, transition, process_noise)
    if measurements.shape[0] == 0:
        return mean, covariance, False
    points, weights = sigma_points(mean, covariance, kappa)
    noises = measurement_noise(points, weights, measurements)
    about, spread = mean.copy(), covariance.copy()
    _fuse(about, spread, points, weights, measurements, noises)
    then, after = about, spread
    for _ in range(_ROUNDS):
        then, after = _fused_about(then, spread, mean, covariance, kappa, measurements, degrees_of_freedom)
    if not _finite(then, after):
        return mean, covariance, False
    return then, after, True
