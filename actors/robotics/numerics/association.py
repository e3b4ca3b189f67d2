"""Joint probabilistic data association: which detections come from which tracks, and the tracks after a scan.

A joint event gives each track at most one detection, and each detection at most one track; the others are clutter.
Its probability is proportional to the product of a weight for each track: ``P_D N(z_j) / density`` if it caused
detection j, ``1 - P_D P_G`` if it caused none inside its gate (Fortmann, Bar-Shalom & Scheffe, IEEE J. Oceanic Eng. 8,
1983).  Tracks that share no gated detection are independent, so sums are taken in each cluster alone.

A track may also not exist at all.  P_D is then to be multiplied by the probability that it does, and what the scan
tells about that follows from the same sum (Musicki & Evans, IEEE Trans. Aerosp. Electron. Syst. 40, 2004).

The sum over all events of a cluster is exact, and does not list them: detections are taken one after the other, and all
that matters of the ones before is the set of tracks that they used.  Two passes over these sets, forwards and
backwards, give every probability.  They need 2^tracks (1 + detections) numbers; a cluster that needs more than
``LARGEST`` is solved by Fitzgerald's formula instead, in which each pair competes with all others of its track and its
detection.
"""

from __future__ import annotations

import math

import numpy as np

from ...core.elementary import exp
from .compiled import Array, Layers, Row, Table, inner, kernel
from .ukf import (
    _OBSERVER,
    _add_products,
    _finite,
    _range,
    _root,
    centred,
    constant_velocity,
    images_of,
    measurement_noise,
    predict,
    rows_of,
    sigma_points,
    update,
)

VALUE = _OBSERVER + 2  # column; a scan is in the plane
LARGEST = 1 << 17  # numbers of a pass over a cluster: 10 tracks with 127 detections, or 5 with 4095
_TERMS = 1000  # of a series that ends long before


@inner
def gate_probability(gate: float, dimensions: int) -> float:
    """The probability that a sum of squares of 1 or 2 standard normal variables is at most ``gate``."""
    decay = exp(-0.5 * gate)
    if dimensions == 2:
        return 1.0 - decay
    below = term = math.sqrt(2.0 * gate / math.pi) * decay  # the series of erf(sqrt(gate / 2))
    for i in range(1, _TERMS):
        term *= gate / (2.0 * i + 1.0)
        below += term
        if term <= 1e-17 * below:
            break
    return min(below, 1.0)


@inner
def _labels(weights: Array) -> Array:
    """A number for each track, which tracks that share a gated detection have in common."""
    tracks, columns = weights.shape
    labels = np.empty(tracks)
    for t in range(tracks):
        labels[t] = t
    changed = True
    while changed:
        changed = False
        for j in range(1, columns):
            least = math.inf
            for t in range(tracks):
                if weights[t, j] > 0.0:
                    least = min(least, labels[t])
            for t in range(tracks):
                if weights[t, j] > 0.0 and labels[t] > least:
                    labels[t] = least
                    changed = True
    return labels


@inner
def _sum_events(weights: Array) -> Array:
    """The probabilities (T, 1 + m) of one cluster with weights (T, 1 + m), by both passes."""
    tracks, columns = weights.shape
    sets = 1 << tracks
    before, after = np.zeros((columns, sets)), np.zeros((columns, sets))
    before[0, 0] = 1.0
    for j in range(1, columns):
        for used in range(sets):
            value = before[j - 1, used]
            if value > 0.0:
                before[j, used] += value
                for t in range(tracks):
                    if used & (1 << t) == 0:
                        before[j, used | (1 << t)] += value * weights[t, j]
    for used in range(sets):
        value = 1.0
        for t in range(tracks):
            if used & (1 << t) == 0:
                value *= weights[t, 0]
        after[columns - 1, used] = value
    for j in range(columns - 1, 0, -1):
        for used in range(sets):
            value = after[j, used]
            for t in range(tracks):
                if used & (1 << t) == 0:
                    value += weights[t, j] * after[j, used | (1 << t)]
            after[j - 1, used] = value
    result, total = np.zeros((tracks, columns)), after[0, 0]
    for t in range(tracks):
        if not total > 0.0:  # every event is impossible
            result[t, 0] = 1.0
            continue
        for used in range(sets):
            if used & (1 << t) != 0:
                continue
            result[t, 0] += before[columns - 1, used] * after[columns - 1, used]
            for j in range(1, columns):
                if weights[t, j] > 0.0:
                    result[t, j] += before[j - 1, used] * weights[t, j] * after[j, used | (1 << t)]
        for j in range(columns):
            result[t, j] /= total
    return result


@inner
def _compete(weights: Array) -> Array:
    """The same by Fitzgerald's formula."""
    tracks, columns = weights.shape
    result, claims = np.zeros((tracks, columns)), np.zeros(columns)
    for t in range(tracks):
        for j in range(1, columns):
            claims[j] += weights[t, j]
    for t in range(tracks):
        rows, kept = 0.0, 1.0
        for j in range(1, columns):
            rows += weights[t, j]
        for j in range(1, columns):
            if weights[t, j] > 0.0:
                result[t, j] = weights[t, j] / (rows + weights[t, 0] - weights[t, j] + claims[j])
            kept -= result[t, j]
        result[t, 0] = max(kept, 0.0)
    return result


@inner
def association_probabilities(weights: Array) -> tuple[Array, int]:
    """The probabilities (T, 1 + m) that tracks caused no detection, or one of m, and how many were not exact.

    ``weights`` (T, 1 + m): of no detection in the first column, then of each detection, 0 outside of the gate.
    """
    tracks, columns = weights.shape
    result, labels, rough = np.zeros((tracks, columns)), _labels(weights), 0
    for label in range(tracks):
        members, near = np.empty(tracks, np.int64), np.empty(columns, np.int64)
        count = width = 0
        for t in range(tracks):
            if labels[t] == label:
                members[count] = t
                count += 1
        if count == 0:
            continue
        for j in range(columns):
            gated = j == 0
            for k in range(count):
                gated = gated or weights[members[k], j] > 0.0
            if gated:
                near[width] = j
                width += 1
        own = np.empty((count, width))
        for k in range(count):
            largest = 0.0
            for i in range(width):
                own[k, i] = weights[members[k], near[i]]
                largest = max(largest, own[k, i])
            for i in range(width):  # a factor common to all events
                own[k, i] = own[k, i] / largest if largest > 0.0 else 0.0
        if count < 32 and (1 << count) * width <= LARGEST:
            found = _sum_events(own)
        else:
            for k in range(count):
                for i in range(width):
                    own[k, i] = weights[members[k], near[i]]
            found, rough = _compete(own), rough + count
        for k in range(count):
            for i in range(width):
                result[members[k], near[i]] = found[k, i]
    return result, rough


@inner
def _expected(points: Array, weights: Array, sensor: Array, noises: Array) -> tuple[Array, Array]:
    """What a sensor (1, 7) should measure of a target at sigma points, and the covariance of the innovation as a lower
    Cholesky factor."""
    images, _, spread = images_of(points, sensor, noises)
    expected = centred(images, weights)
    _add_products(spread, weights, images, images)
    return expected, _root(spread)


@inner
def _squared(difference: Array, root: Array) -> float:
    """The squared Mahalanobis length of a difference (k,), with the Cholesky factor of its covariance; inf if that is
    singular."""
    solved, result = np.empty(difference.shape[0]), 0.0
    for j in range(difference.shape[0]):
        if not root[j, j] > 0.0:
            return math.inf
        total = difference[j]
        for k in range(j):
            total -= root[j, k] * solved[k]
        solved[j] = total / root[j, j]
        result += solved[j] * solved[j]
    return result


@inner
def _share_in_range(points: Array, weights: Array, sensor: Array, max_range: float) -> float:
    """The probability that a target at sigma points is within the range of a sensor (1, 7)."""
    result = 0.0
    for i in range(points.shape[0]):
        if _range(points, i, sensor, 0) <= max_range:
            result += weights[i]
    return result


@inner
def detection_weights(
    means: Array, covariances: Array, existence: Array, kappa: float, sensor: Array, detections: Array,
    probability: float, density: float, max_range: float, gate: float, averaged: bool,
) -> tuple[Array, Array, Array, Array]:  # fmt: skip
    """The weights (T, 1 + m) of m detections (m, 7) of one scan for tracks (T, n), which exist with probabilities
    ``existence`` (T,); how likely each is in range of the sensor (T,), and not detected in its gate if it exists (T,);
    and the noise covariances (T, 3) of a detection of it.

    ``sensor`` (7,) is a detection without a value.  ``density`` is that of detections from elsewhere in the space of
    values, in 1 / m^2, or 1 / m for ranges.
    """
    tracks, count = means.shape[0], detections.shape[0]
    weights, noises = np.zeros((tracks, 1 + count)), np.empty((tracks, 3))
    shares, silent = np.empty(tracks), np.empty(tracks)
    row = sensor.reshape((1, sensor.shape[0]))
    size = rows_of(row)
    inside = gate_probability(gate, size)
    for t in range(tracks):
        points, spread = sigma_points(means[t], covariances[t], kappa)
        if averaged:
            noises[t] = measurement_noise(points, spread, row)[0]
        else:
            noises[t] = measurement_noise(points[:1], np.ones(1), row)[0]
        shares[t] = _share_in_range(points, spread, row, max_range)
        expected, root = _expected(points, spread, row, noises[t : t + 1])
        detected = probability * min(shares[t], 1.0)
        silent[t] = 1.0 - detected * inside
        weights[t, 0] = 1.0 - existence[t] * detected * inside
        height = existence[t] * detected / density
        for k in range(size):
            height /= root[k, k] * math.sqrt(2.0 * math.pi)
        for j in range(count):
            difference = np.empty(size)
            for k in range(size):
                difference[k] = detections[j, VALUE + k] - expected[k]
            squared = _squared(difference, root)
            if squared <= gate:
                weights[t, 1 + j] = height * exp(-0.5 * squared)
    return weights, shares, silent, noises


@inner
def _exist(caused: Array, before: float, missed: float, silent: float) -> float:
    """How likely a track exists after a scan, with the probabilities (1 + m,) of what it caused, which become those of
    an existing one; ``missed`` was its weight of no detection, and ``silent`` that of an existing one."""
    if not before < 1.0:
        return before
    alive = before * silent / missed if missed > 0.0 else before
    caused[0] *= alive
    after = 0.0
    for j in range(caused.shape[0]):
        after += caused[j]
    after = min(after, 1.0)
    for j in range(caused.shape[0]):
        if after > 0.0:
            caused[j] /= after
        else:
            caused[j] = 1.0 if j == 0 else 0.0
    return after


@inner
def _mixed(probabilities: Array, means: Array, covariances: Array) -> tuple[Array, Array]:
    """The mean and covariance of a mixture of normal distributions."""
    size = means.shape[1]
    mean, covariance = np.zeros(size), np.zeros((size, size))
    for i in range(probabilities.shape[0]):
        for j in range(size):
            mean[j] += probabilities[i] * means[i, j]
    for i in range(probabilities.shape[0]):
        for j in range(size):
            for k in range(size):
                apart = (means[i, j] - mean[j]) * (means[i, k] - mean[k])
                covariance[j, k] += probabilities[i] * (covariances[i, j, k] + apart)
    return mean, covariance


@kernel
def fuse_scan(
    means: Table, covariances: Layers, existence: Row, kappa: float, sensor: Row, detections: Table,
    probability: float, density: float, max_range: float, gate: float, averaged: bool,
) -> tuple[Table, Layers, Row, Table, Row, int]:  # fmt: skip
    """Tracks (T, n) after a scan: their means and covariances, how likely each exists (T,), which detection each caused
    if it exists (T, 1 + m), how likely each is in range (T,), and how many tracks' probabilities are not exact.

    A track becomes the mixture of what each of its detections would make of it, and itself, by its first two moments.
    A track whose result would not be finite stays as it is.
    """
    weights, shares, silent, noises = detection_weights(
        means, covariances, existence, kappa, sensor, detections, probability, density, max_range, gate, averaged
    )
    caused, rough = association_probabilities(weights)
    then, spread, alive = means.copy(), covariances.copy(), existence.copy()
    size = means.shape[1]
    for t in range(means.shape[0]):
        alive[t] = _exist(caused[t], existence[t], weights[t, 0], silent[t])
        count = 0
        for j in range(caused.shape[1]):
            count += 1 if caused[t, j] > 0.0 else 0
        if count == 1 and caused[t, 0] > 0.0:
            continue
        shared, each, around = np.empty(count), np.empty((count, size)), np.empty((count, size, size))
        i = 0
        for j in range(caused.shape[1]):
            if not caused[t, j] > 0.0:
                continue
            shared[i], each[i], around[i] = caused[t, j], means[t], covariances[t]
            if j > 0:
                each[i], around[i] = update(means[t], covariances[t], kappa, detections[j - 1 : j], noises[t : t + 1])
            i += 1
        mean, covariance = _mixed(shared, each, around)
        if _finite(mean, covariance):
            then[t], spread[t] = mean, covariance
    return then, spread, alive, caused, shares, rough


@kernel
def predict_tracks(
    means: Table, covariances: Layers, existence: Row, noise: Table, elapsed: float, lifetime: float
) -> tuple[Table, Layers, Row]:
    """Tracks (T, 4) ``elapsed`` seconds later, with the process ``noise`` of that time; targets have a mean
    ``lifetime``."""
    then, spread, alive = means.copy(), covariances.copy(), existence.copy()
    stays = exp(-elapsed / lifetime)
    transition = constant_velocity(elapsed)
    for t in range(means.shape[0]):
        then[t], spread[t] = predict(means[t], covariances[t], transition, noise)
        alive[t] *= stays
    return then, spread, alive


@kernel
def new_track(detection: Row, velocity_variance: float) -> tuple[Row, Table]:
    """The mean (4,) and covariance of a track that begins with one relative position: at rest, so far as is known."""
    mean, covariance = np.zeros(4), np.zeros((4, 4))
    place = np.empty((1, 2))
    for c in range(2):
        mean[c] = place[0, c] = detection[_OBSERVER + c] + detection[VALUE + c]
        covariance[2 + c, 2 + c] = velocity_variance
    noise = measurement_noise(place, np.ones(1), detection.reshape((1, detection.shape[0])))
    covariance[0, 0], covariance[1, 1] = noise[0, 0], noise[0, 2]
    covariance[0, 1] = covariance[1, 0] = noise[0, 1]
    return mean, covariance


@inner
def _separation(means: Array, covariances: Array, i: int, j: int) -> float:
    """The squared Mahalanobis distance of two tracks, as if they were independent."""
    spread, difference = covariances[i].copy(), means[i].copy()
    for k in range(difference.shape[0]):
        difference[k] -= means[j, k]
        for m in range(difference.shape[0]):
            spread[k, m] += covariances[j, k, m]
    return _squared(difference, _root(spread))


@kernel
def duplicates(means: Table, covariances: Layers, distance: float) -> Row:
    """1 for each track (T, n) nearer than a squared Mahalanobis ``distance`` to an earlier one without a 1, else 0."""
    result = np.zeros(means.shape[0])
    for i in range(means.shape[0]):
        for j in range(i):
            if result[j] == 0.0 and _separation(means, covariances, i, j) < distance:
                result[i] = 1.0
    return result


@kernel
def separations(means: Table, covariances: Layers, count: int) -> Table:
    """The squared Mahalanobis distance of each of the first ``count`` tracks (T, n), a row, to each of the others."""
    others = means.shape[0] - count
    result = np.empty((count, others))
    for i in range(count):
        for j in range(others):
            result[i, j] = _separation(means, covariances, i, count + j)
    return result
