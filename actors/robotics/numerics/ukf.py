"""The unscented Kalman filter on arrays (Julier & Uhlmann; paper section II.B): sigma points, prediction, update."""

from __future__ import annotations

import math

import numpy as np

from ...core.elementary import hypot
from .compiled import Array, Row, Table, borrower, inner, kernel

RELATIVE_POSITION = 0
RANGE = 1

# Columns of a table of measurements, one per row, from observers with d dimensions.  A target with fewer is on the
# ground.
_KIND = 0
_OBSERVER = 1  # vector; then another one from there to the target, or the range and anything
_ALONG = -2  # standard deviation along the line of sight
_ACROSS = -1  # standard deviation across the line of sight; not used for a range


@inner
def _root(covariance: Array) -> Array:
    """Lower Cholesky factor; a pivot that rounding made negative counts as zero."""
    size = covariance.shape[0]
    root = np.zeros((size, size))
    for i in range(size):
        for j in range(i + 1):
            total = covariance[i, j]
            for k in range(j):
                total -= root[i, k] * root[j, k]
            if i == j:
                root[i, i] = math.sqrt(max(total, 0.0))
            elif root[j, j] > 0.0:
                root[i, j] = total / root[j, j]
    return root


@kernel
def sigma_points(mean: Row, covariance: Table, kappa: float) -> tuple[Table, Row]:
    """The 2n + 1 points (M, n) and weights (M,): the mean, then mean +- columns of sqrt((n + kappa) C)."""
    size = mean.shape[0]
    root = _root(covariance)
    scale = math.sqrt(size + kappa)
    points = np.empty((2 * size + 1, size))
    weights = np.empty(2 * size + 1)
    for i in range(2 * size + 1):
        weights[i] = 0.5 / (size + kappa)
    weights[0] = kappa / (size + kappa)
    for j in range(size):
        points[0, j] = mean[j]
    for i in range(size):
        for j in range(size):
            points[1 + i, j] = mean[j] + scale * root[j, i]
            points[1 + size + i, j] = mean[j] - scale * root[j, i]
    return points, weights


@inner
def congruence(a: Array, b: Array, onto: Array) -> Array:
    """onto + a @ b @ a.T."""
    result = onto.copy()
    _add_congruence(result, np.zeros(a.shape), a, b)
    return result


@borrower
def _add_congruence(result: Array, half: Array, a: Array, b: Array) -> None:
    """Add a @ b @ a.T; ``half``, zeros, becomes a @ b; summed in index order, so that the last bits do not depend on a
    BLAS."""
    size, inside = a.shape
    for i in range(size):
        for k in range(inside):
            if a[i, k] != 0.0:
                for j in range(inside):
                    half[i, j] += a[i, k] * b[k, j]
    for i in range(size):
        for j in range(size):
            for k in range(inside):
                result[i, j] += half[i, k] * a[j, k]


@borrower
def _add_products(result: Array, weights: Array, a: Array, b: Array) -> None:
    """Add sum_i weights_i a_i b_i^T."""
    for i in range(weights.shape[0]):
        for j in range(result.shape[0]):
            for k in range(result.shape[1]):
                result[j, k] += weights[i] * a[i, j] * b[i, k]


@inner
def mapped(a: Array, x: Array) -> Array:
    """a @ x summed in index order."""
    result = np.zeros(a.shape[0])
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            result[i] += a[i, j] * x[j]
    return result


@borrower
def _symmetrise(a: Array) -> None:
    """Replace a by the mean of a and its transpose; in loops, as array expressions take seconds to compile."""
    for i in range(a.shape[0]):
        for j in range(i):
            a[i, j] = a[j, i] = 0.5 * (a[i, j] + a[j, i])


@borrower
def dimensions_of(measurements: Array) -> int:
    """The dimensions of the observers in a table of measurements."""
    d: int = (measurements.shape[1] - 3) // 2
    return d


@borrower
def _away(points: Array, i: int, measurements: Array, m: int, c: int) -> float:
    """How far a point is from an observer along an axis."""
    there = points[i, c] if c < max(2, points.shape[1] // 2) else 0.0
    away: float = there - measurements[m, _OBSERVER + c]
    return away


@inner
def constant_velocity(period: float, dimensions: int = 2) -> Array:
    """Transition of eq. (1) for the state (x, y, vx, vy)."""
    transition = np.zeros((2 * dimensions, 2 * dimensions))  # np.eye takes half a second to compile
    for i in range(2 * dimensions):
        transition[i, i] = 1.0
    for i in range(dimensions):
        transition[i, dimensions + i] = period
    return transition


@kernel
def predict(mean: Row, covariance: Table, transition: Table, process_noise: Table) -> tuple[Row, Table]:
    """One step of a linear model; the unscented transform of a linear map is exact, so it is written out."""
    spread = congruence(transition, covariance, np.zeros(covariance.shape))
    for i in range(spread.shape[0]):
        for j in range(spread.shape[1]):
            spread[i, j] += process_noise[i, j]
    _symmetrise(spread)
    return mapped(transition, mean), spread


@inner
def measurement_noise(points: Array, weights: Array, measurements: Array) -> Array:
    """Covariances (m, d (d + 1) / 2), upper triangles, of measurements (m, 3 + 2 d) of a target at ``points`` (M, n).

    Of a range, the first number counts.

    A relative position has one deviation (sigma_d) on the line of sight and another (sigma_b) across it, so its
    covariance depends on where the target is.  It is averaged over the points.  With the sigma points it is the
    expected covariance: near a target whose direction is uncertain the ellipse is rounder than the one turned along
    the mean, which would let the large deviation leak into the small one.  With the mean as the only point, it is the
    ellipse turned along the mean.
    """
    d = dimensions_of(measurements)
    noises, n = np.zeros((measurements.shape[0], d * (d + 1) // 2)), np.empty(d)
    for m in range(measurements.shape[0]):
        along, across = measurements[m, _ALONG], measurements[m, _ACROSS]
        a, b = along * along, across * across
        if measurements[m, _KIND] == RANGE:
            noises[m, 0] = a
            continue
        for i in range(points.shape[0]):
            length = _range(points, i, measurements, m)
            for c in range(d):
                n[c] = _away(points, i, measurements, m, c) / length if length > 0.0 else 0.0
            if not length > 0.0:
                n[0] = 1.0
            place = 0
            for p in range(d):
                for q in range(p, d):
                    if p == q:
                        part = a * n[p] * n[p]
                        for k in range(d):
                            if k != p:
                                part += b * n[k] * n[k]
                        noises[m, place] += weights[i] * part
                    else:
                        noises[m, place] += weights[i] * (a - b) * n[p] * n[q]
                    place += 1
    return noises


@borrower
def _range(points: Array, i: int, measurements: Array, m: int) -> float:
    """The distance of a point from an observer."""
    length = hypot(_away(points, i, measurements, m, 0), _away(points, i, measurements, m, 1))
    for c in range(2, dimensions_of(measurements)):
        length = hypot(length, _away(points, i, measurements, m, c))
    return length


@inner
def update(mean: Array, covariance: Array, kappa: float, measurements: Array, noises: Array) -> tuple[Array, Array]:
    """Fuse measurements (m, 3 + 2 d) with covariances ``noises`` (m, d (d + 1) / 2), all at once.

    Stacking them makes the result independent of their order up to rounding.  The posterior covariance is built as
    sum_i w_i e_i e_i^T + K R K^T with e_i = (x_i - x) - K (z_i - z), which is C - K S K^T written so that rounding
    cannot make it indefinite (weights are not negative for kappa >= 0).
    """
    updated, spread = mean.copy(), covariance.copy()
    if measurements.shape[0] > 0:
        points, weights = sigma_points(mean, covariance, kappa)
        _fuse(updated, spread, points, weights, measurements, noises)
    return updated, spread


@borrower
def rows_of(measurements: Array) -> int:
    """The number of numbers measured."""
    rows = 0
    for m in range(measurements.shape[0]):
        rows += 1 if measurements[m, _KIND] == RANGE else dimensions_of(measurements)
    return rows


@inner
def _fuse(mean: Array, covariance: Array, points: Array, weights: Array, measurements: Array, noises: Array) -> None:
    """``update`` in place, with the sigma points, which are overwritten."""
    images, observed, noise = images_of(points, measurements, noises)
    _fuse_images(mean, covariance, points, weights, images, observed, noise)


@inner
def images_of(points: Array, measurements: Array, noises: Array) -> tuple[Array, Array, Array]:
    """What is measured at each of the points (M, rows), and in truth (rows,), and the covariance of the noise."""
    count, d, rows = points.shape[0], dimensions_of(measurements), rows_of(measurements)
    noise, images, observed = np.zeros((rows, rows)), np.empty((count, rows)), np.empty(rows)
    row = 0
    for m in range(measurements.shape[0]):
        is_range = measurements[m, _KIND] == RANGE
        width, place = 1 if is_range else d, 0
        for p in range(width):
            for q in range(p, width):
                noise[row + p, row + q] = noise[row + q, row + p] = noises[m, place]
                place += 1
            observed[row + p] = measurements[m, _OBSERVER + d + p]
        for i in range(count):
            for c in range(width):
                images[i, row + c] = (
                    _range(points, i, measurements, m) if is_range else _away(points, i, measurements, m, c)
                )
        row += width
    return images, observed, noise


@inner
def centred(images: Array, weights: Array) -> Array:
    """The expected row (rows,) of images (M, rows), which become relative to it."""
    expected = np.zeros(images.shape[1])
    for k in range(images.shape[1]):
        for i in range(images.shape[0]):
            expected[k] += weights[i] * images[i, k]
        for i in range(images.shape[0]):
            images[i, k] -= expected[k]
    return expected


@inner
def _fuse_images(
    mean: Array, covariance: Array, points: Array, weights: Array, images: Array, observed: Array, noise: Array
) -> None:
    """The update in place, with what is measured at each sigma point (M, rows), and in truth; these are overwritten."""
    size, count, rows = mean.shape[0], points.shape[0], observed.shape[0]
    expected = centred(images, weights)
    for k in range(rows):
        observed[k] -= expected[k]
    for i in range(count):
        for j in range(size):
            points[i, j] -= mean[j]
    innovation_covariance, cross, half = noise.copy(), np.zeros((size, rows)), np.zeros((size, rows))
    _add_products(innovation_covariance, weights, images, images)
    _add_products(cross, weights, points, images)
    gain = _gain(innovation_covariance, cross)
    for j in range(size):
        for k in range(size):
            covariance[j, k] = 0.0
        for k in range(rows):
            mean[j] += gain[j, k] * observed[k]
            for i in range(count):
                points[i, j] -= gain[j, k] * images[i, k]
    _add_congruence(covariance, half, gain, noise)
    _add_products(covariance, weights, points, points)
    _symmetrise(covariance)


@kernel
def fuse_images(
    mean: Row, covariance: Table, points: Table, weights: Row, images: Table, observed: Row, noise: Table
) -> tuple[Row, Table, bool]:
    """``update`` with measurements of any sensor, and whether anything was fused.

    ``images`` (M, rows) would be measured at the sigma ``points``, ``observed`` (rows,) was; ``noise`` is their
    covariance.  If the result would not be finite, nothing is fused.
    """
    then, spread = mean.copy(), covariance.copy()
    _fuse_images(then, spread, points.copy(), weights, images.copy(), observed.copy(), noise)
    if not _finite(then, spread):
        return mean, covariance, False
    return then, spread, True


@borrower
def _finite(mean: Array, covariance: Array) -> bool:
    for i in range(mean.shape[0]):
        if not abs(mean[i]) < math.inf:
            return False
        for j in range(mean.shape[0]):
            if not abs(covariance[i, j]) < math.inf:
                return False
    return True


@kernel
def predict_and_fuse(
    mean: Row, covariance: Table, transition: Table, process_noise: Table, kappa: float, measurements: Table,
    averaged: bool,
) -> tuple[Row, Table, bool]:  # fmt: skip
    """``predict``, then ``update`` with measurements (m, 3 + 2 d), and whether anything was fused.

    All noises are as seen from the prediction, and ``averaged`` over its sigma points, or turned along its mean.  If
    the result would not be finite, the prediction is kept.
    """
    mean, covariance = predict(mean, covariance, transition, process_noise)
    if measurements.shape[0] == 0:
        return mean, covariance, False
    points, weights = sigma_points(mean, covariance, kappa)
    if averaged:
        noises = measurement_noise(points, weights, measurements)
    else:
        noises = measurement_noise(points[:1], np.ones(1), measurements)  # of the mean
    then, spread = mean.copy(), covariance.copy()
    _fuse(then, spread, points, weights, measurements, noises)
    if not _finite(then, spread):
        return mean, covariance, False
    return then, spread, True


@inner
def _gain(innovation_covariance: Array, cross: Array) -> Array:
    """cross @ inverse(innovation_covariance) by its Cholesky factor; a direction without variance gains nothing."""
    root = _root(innovation_covariance)
    rows = root.shape[0]
    gain = np.empty(cross.shape)
    for j in range(cross.shape[0]):
        for k in range(rows):
            total = cross[j, k]
            for m in range(k):
                total -= root[k, m] * gain[j, m]
            gain[j, k] = total / root[k, k] if root[k, k] > 0.0 else 0.0
        for k in range(rows - 1, -1, -1):
            total = gain[j, k]
            for m in range(k + 1, rows):
                total -= root[m, k] * gain[j, m]
            gain[j, k] = total / root[k, k] if root[k, k] > 0.0 else 0.0
    return gain
