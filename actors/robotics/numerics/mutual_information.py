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
from .compiled import Array, borrower
from .entry import entry
from .terms import Term


@entry("f8[:, ::1](f8[:, ::1], f8[:, :, ::1], f8)")
def pairwise_distance(sigma_positions: Array, robots: Array, variance: float) -> Array:
    """``others_distance``: (M, M) from sigma points (M, 2) and the ends of the other robots' paths (n, N, 2)."""
    count, last = sigma_positions.shape[0], robots.shape[1] - 1
    distance = np.zeros((count, count))
    ranges = np.empty(count)
    for r in range(robots.shape[0]):
        for i in range(count):
            x, y = sigma_positions[i, 0] - robots[r, last, 0], sigma_positions[i, 1] - robots[r, last, 1]
            ranges[i] = hypot(x, y)
        for i in range(count):
            for j in range(count):
                difference = ranges[i] - ranges[j]
                distance[i, j] += difference * difference / (2.0 * variance)
    return distance


# Columns of a table of sigma points, one per row.
_PLACE = 0  # x, y
_WEIGHT = 2
_RANGE = 3  # r, the distance from the own position
_DIRECTION = 4  # vector u, the gradient of r
_BEND = 6  # (xx, xy, yy) of the Hessian of r, (1 - u u^T) / r
_SUM = 9  # sum over j of w_j exp(-E_ij), later its inverse
_MEAN = 10  # sum over j of q_ij grad E_ij
PAIRS = 12  # others_distance_ij for all j < i, each followed by exp(-E_ij)


@borrower
def new_points(sigma_positions: Array, weights: Array, others_distance: Array, points: Array) -> int:
    """Write the sigma points with a weight, in rows with room for ``informed``, target by target; returns how many."""
    count, size = 0, weights.shape[0]
    for i in range(sigma_positions.shape[0]):
        own = i % size
        if weights[own] == 0.0:
            continue
        points[count, _PLACE], points[count, _PLACE + 1] = sigma_positions[i, 0], sigma_positions[i, 1]
        points[count, _WEIGHT] = weights[own]
        column = PAIRS
        for j in range(own):
            if weights[j] != 0.0:
                points[count, column] = others_distance[i, j]
                column += 2
        count += 1
    return count


@borrower
def informed(points: Array, x: float, y: float, variance: float) -> Term:
    """-I of one target at own position (x, y) with its gradient and Hessian: (value, d/dx, d/dy, xx, xy, yy).

    The density's constant factor (2 pi eta)^(-n/2) is left out: it shifts I but not the optimum.  Derivation: with E_ij
    = (r_i - r_j)^2 / (2 eta) + others_distance_ij and q_ij = w_j exp(-E_ij) normalised over j, grad(-I) = -sum_i w_i
    sum_j q_ij grad E_ij; the Hessian follows by the usual log-sum-exp rule.
    E is symmetric and zero on the diagonal, so each pair is visited once, and no exponential overflows.
    """
    count = points.shape[0]
    precision = 1.0 / variance
    for i in range(count):
        dx, dy = x - points[i, _PLACE], y - points[i, _PLACE + 1]
        r = max(math.sqrt(dx * dx + dy * dy), 1e-9)
        bend, weight = 1.0 / r, points[i, _WEIGHT]
        ux, uy = bend * dx, bend * dy
        points[i, _RANGE], points[i, _DIRECTION], points[i, _DIRECTION + 1] = r, ux, uy
        points[i, _BEND] = bend * (1.0 - ux * ux)
        points[i, _BEND + 1] = -bend * ux * uy
        points[i, _BEND + 2] = bend * (1.0 - uy * uy)
        points[i, _MEAN] = points[i, _MEAN + 1] = 0.0
        total = weight
        for j in range(i):
            difference = r - points[j, _RANGE]
            likeness = exp(-0.5 * precision * difference * difference - points[i, PAIRS + 2 * j])
            points[i, PAIRS + 2 * j + 1] = likeness
            total += points[j, _WEIGHT] * likeness
            points[j, _SUM] += weight * likeness
        points[i, _SUM] = total
    value = gx = gy = hxx = hxy = hyy = 0.0
    for i in range(count):
        weight, r, share = points[i, _WEIGHT], points[i, _RANGE], 1.0 / points[i, _SUM]
        ux, uy = points[i, _DIRECTION], points[i, _DIRECTION + 1]
        bxx, bxy, byy = points[i, _BEND], points[i, _BEND + 1], points[i, _BEND + 2]
        value += weight * log(points[i, _SUM])
        points[i, _SUM] = share
        mx = my = 0.0
        for j in range(i):
            dx, dy = ux - points[j, _DIRECTION], uy - points[j, _DIRECTION + 1]
            slope, other = precision * (r - points[j, _RANGE]), points[j, _WEIGHT]
            ex, ey = slope * dx, slope * dy
            likeness = points[i, PAIRS + 2 * j + 1]
            here, there = other * likeness * share, weight * likeness * points[j, _SUM]  # q_ij and q_ji
            mx += here * ex
            my += here * ey
            points[j, _MEAN] += there * ex
            points[j, _MEAN + 1] += there * ey
            both, bend = weight * here + other * there, precision - slope * slope
            hxx -= both * (bend * dx * dx + slope * (bxx - points[j, _BEND]))
            hxy -= both * (bend * dx * dy + slope * (bxy - points[j, _BEND + 1]))
            hyy -= both * (bend * dy * dy + slope * (byy - points[j, _BEND + 2]))
        points[i, _MEAN] += mx
        points[i, _MEAN + 1] += my
    for i in range(count):
        weight, mx, my = points[i, _WEIGHT], points[i, _MEAN], points[i, _MEAN + 1]
        gx -= weight * mx
        gy -= weight * my
        hxx -= weight * mx * mx
        hxy -= weight * mx * my
        hyy -= weight * my * my
    return value, gx, gy, hxx, hxy, hyy
