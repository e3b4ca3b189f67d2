"""Mutual information between the obstacle's predicted state and the robots' future range measurements, eq. (5).

With sigma points i of weight w_i, and z_i the vector of ranges that the robots would measure if the obstacle were
at sigma point i, the paper (after Charrow et al.) approximates

    I = - sum_i w_i log sum_j w_j PDF(z_i; z_j, eta)

PDF is the normal density over all robots' ranges, variance eta each.  Only the own position is a variable, so the
other robots enter through constants: ``others_distance[i, j] = sum_r (z_ri - z_rj)^2 / (2 eta)``.
"""

from __future__ import annotations

import math

import numpy as np

from ...core.elementary import exp, hypot, log
from .compiled import Array, Layers, Table, borrower, inlined, kernel
from .vectors import (
    Term,
    Vector,
    less,
    packed,
    plus,
    quadratic_size,
    read,
    replaced,
    scaled,
    squared,
    symmetric_size,
    total,
    write,
    zero_symmetric,
    zero_term,
    zero_vector,
)


@kernel
def pairwise_distance(sigma_positions: Table, robots: Layers, variance: float) -> Table:
    """``others_distance``: (M, M) from sigma points (M, d) and the ends of the other robots' paths (n, N, d)."""
    (count, d), last = sigma_positions.shape, robots.shape[1] - 1
    distance = np.zeros((count, count))
    ranges = np.empty(count)
    for r in range(robots.shape[0]):
        for i in range(count):
            x, y = sigma_positions[i, 0] - robots[r, last, 0], sigma_positions[i, 1] - robots[r, last, 1]
            ranges[i] = hypot(x, y)
            for c in range(2, d):
                ranges[i] = hypot(ranges[i], sigma_positions[i, c] - robots[r, last, c])
        for i in range(count):
            for j in range(count):
                difference = ranges[i] - ranges[j]
                distance[i, j] += difference * difference / (2.0 * variance)
    return distance


# Columns of a table of sigma points, one per row, in d dimensions.
_WEIGHT = 0
_RANGE = 1  # r, the distance from the own position
_SUM = 2  # sum over j of w_j exp(-E_ij), later its inverse
_PLACE = 3  # vector


@inlined
def _direction(d: int) -> int:
    """Vector u, the gradient of r; then the Hessian of r, (1 - u u^T) / r."""
    return _PLACE + d


@inlined
def _mean(d: int) -> int:
    """Vector, the sum over j of q_ij grad E_ij."""
    return _PLACE + d + quadratic_size(d)


@inlined
def _pairs(d: int) -> int:
    """``others_distance_ij`` for all j < i, each followed by exp(-E_ij)."""
    return _mean(d) + d


@inlined
def point_columns(d: int, points: int) -> int:
    """The number of columns for a number of points."""
    return _pairs(d) + 2 * points


@borrower
def new_points(sigma_positions: Array, weights: Array, others_distance: Array, points: Array, zero: Vector) -> int:
    """Write the sigma points with a weight, in rows with room for ``informed``, target by target; returns how many.

    ``zero`` is a vector of zeros.
    """
    count, size, d = 0, weights.shape[0], len(zero)
    for i in range(sigma_positions.shape[0]):
        own = i % size
        if weights[own] == 0.0:
            continue
        for c in range(d):
            points[count, _PLACE + c] = sigma_positions[i, c]
        points[count, _WEIGHT] = weights[own]
        column = _pairs(d)
        for j in range(own):
            if weights[j] != 0.0:
                points[count, column] = others_distance[i, j]
                column += 2
        count += 1
    return count


@borrower
def informed(points: Array, at: Vector, variance: float) -> Term:
    """-I of one target at the own position with its gradient and Hessian.

    The density's constant factor (2 pi eta)^(-n/2) is left out: it shifts I but not the optimum.  Derivation: with E_ij
    = (r_i - r_j)^2 / (2 eta) + others_distance_ij and q_ij = w_j exp(-E_ij) normalised over j, grad(-I) = -sum_i w_i
    sum_j q_ij grad E_ij; the Hessian follows by the usual log-sum-exp rule.
    E is symmetric and zero on the diagonal, so each pair is visited once, and no exponential overflows.
    """
    count, d = points.shape[0], len(at)
    direction, bends, mean, pairs = _direction(d), _direction(d) + d, _mean(d), _pairs(d)
    precision = 1.0 / variance
    for i in range(count):
        offset = less(at, read(at, points, i, _PLACE))
        r = max(math.sqrt(squared(offset)), 1e-9)
        bend, weight = 1.0 / r, points[i, _WEIGHT]
        u = scaled(bend, offset)
        points[i, _RANGE] = r
        write(points, i, direction, u)
        for p in range(d):
            for q in range(p, d):
                curvature = bend * (1.0 - u[p] * u[p]) if p == q else -bend * u[p] * u[q]
                points[i, bends + packed(d, p, q)] = curvature
        write(points, i, mean, zero_vector(at))
        summed = weight
        for j in range(i):
            difference = r - points[j, _RANGE]
            likeness = exp(-0.5 * precision * difference * difference - points[i, pairs + 2 * j])
            points[i, pairs + 2 * j + 1] = likeness
            summed += points[j, _WEIGHT] * likeness
            points[j, _SUM] += weight * likeness
        points[i, _SUM] = summed
    value, hessian = 0.0, zero_symmetric(at)
    for i in range(count):
        weight, r, share = points[i, _WEIGHT], points[i, _RANGE], 1.0 / points[i, _SUM]
        u, curvatures = read(at, points, i, direction), read(hessian, points, i, bends)
        value += weight * log(points[i, _SUM])
        points[i, _SUM] = share
        m = zero_vector(at)
        for j in range(i):
            turn, others = less(u, read(at, points, j, direction)), read(hessian, points, j, bends)
            slope, other = precision * (r - points[j, _RANGE]), points[j, _WEIGHT]
            e = scaled(slope, turn)
            likeness = points[i, pairs + 2 * j + 1]
            here, there = other * likeness * share, weight * likeness * points[j, _SUM]  # q_ij and q_ji
            m = plus(m, here, e)
            write(points, j, mean, plus(read(at, points, j, mean), there, e))
            both, bend = weight * here + other * there, precision - slope * slope
            for p in range(d):
                for q in range(p, d):
                    place = packed(d, p, q)
                    change = both * (bend * turn[p] * turn[q] + slope * (curvatures[place] - others[place]))
                    hessian = replaced(hessian, place, hessian[place] - change)
        write(points, i, mean, total(read(at, points, i, mean), m))
    gradient = zero_vector(at)
    for i in range(count):
        weight, m = points[i, _WEIGHT], read(at, points, i, mean)
        gradient = plus(gradient, -weight, m)
        for p in range(d):
            for q in range(p, d):
                place = packed(d, p, q)
                hessian = replaced(hessian, place, hessian[place] - weight * m[p] * m[q])
    term = replaced(zero_term(at), 0, value)
    for c in range(d):
        term = replaced(term, 1 + c, gradient[c])
    for c in range(symmetric_size(d)):
        term = replaced(term, 1 + d + c, hessian[c])
    return term
