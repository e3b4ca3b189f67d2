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

from .compiled import kernel
from .typing import Array


@kernel
def pairwise_distance(sigma_positions: Array, robots: Array, variance: float) -> Array:
    """``others_distance``: (M, M) from sigma points (M, 2) and the other robots' positions (n, 2)."""
    count = sigma_positions.shape[0]
    distance = np.zeros((count, count))
    ranges = np.empty(count)
    for r in range(robots.shape[0]):
        for i in range(count):
            ranges[i] = math.hypot(sigma_positions[i, 0] - robots[r, 0], sigma_positions[i, 1] - robots[r, 1])
        for i in range(count):
            for j in range(count):
                distance[i, j] += (ranges[i] - ranges[j]) ** 2 / (2.0 * variance)
    return distance


@kernel
def negative_information(
    x: float, y: float, sigma_positions: Array, weights: Array, others_distance: Array, variance: float
) -> tuple[float, float, float, float, float, float]:
    """-I at own position (x, y) with its gradient and Hessian: (value, d/dx, d/dy, xx, xy, yy).

    The density's constant factor (2 pi eta)^(-n/2) is left out: it moves I by a constant and no optimum.
    Derivation: with E_ij = (r_i - r_j)^2 / (2 eta) + others_distance_ij and q_ij = w_j exp(-E_ij) normalised over j,
    grad(-I) = -sum_i w_i sum_j q_ij grad E_ij; the Hessian follows by the usual log-sum-exp rule.
    """
    count = sigma_positions.shape[0]
    # Of each point: its range, the direction u to it, and the range's Hessian (1 - u u^T) / range.
    r = np.empty((count, 6))
    for i in range(count):
        dx, dy = x - sigma_positions[i, 0], y - sigma_positions[i, 1]
        distance = max(math.sqrt(dx * dx + dy * dy), 1e-9)
        ux, uy = dx / distance, dy / distance
        r[i, 0], r[i, 1], r[i, 2] = distance, ux, uy
        r[i, 3], r[i, 4], r[i, 5] = (1.0 - ux * ux) / distance, -ux * uy / distance, (1.0 - uy * uy) / distance
    # Of each i, sums over j of q_ij, q_ij grad E_ij, and q_ij times the Hessian of E_ij less its outer gradient
    # product.  E is symmetric and zero on the diagonal, so each pair is visited once, and no exponential overflows.
    sums = np.zeros((count, 6))
    for i in range(count):
        sums[i, 0] = weights[i]
    precision = 1.0 / variance
    for i in range(count):
        if weights[i] == 0.0:
            continue
        for j in range(i):
            if weights[j] == 0.0:
                continue
            difference, dx, dy = r[i, 0] - r[j, 0], r[i, 1] - r[j, 1], r[i, 2] - r[j, 2]
            likeness = math.exp(-0.5 * precision * difference * difference - others_distance[i, j])
            ex, ey = precision * difference * dx, precision * difference * dy
            exx = precision * (dx * dx + difference * (r[i, 3] - r[j, 3])) - ex * ex
            exy = precision * (dx * dy + difference * (r[i, 4] - r[j, 4])) - ex * ey
            eyy = precision * (dy * dy + difference * (r[i, 5] - r[j, 5])) - ey * ey
            for a, b in ((i, j), (j, i)):
                q = weights[b] * likeness
                sums[a, 0] += q
                sums[a, 1] += q * ex
                sums[a, 2] += q * ey
                sums[a, 3] += q * exx
                sums[a, 4] += q * exy
                sums[a, 5] += q * eyy
    value = gx = gy = hxx = hxy = hyy = 0.0
    for i in range(count):
        if weights[i] == 0.0:
            continue
        w, share = weights[i], 1.0 / sums[i, 0]
        mx, my = share * sums[i, 1], share * sums[i, 2]
        value += w * math.log(sums[i, 0])
        gx -= w * mx
        gy -= w * my
        hxx -= w * (share * sums[i, 3] + mx * mx)
        hxy -= w * (share * sums[i, 4] + mx * my)
        hyy -= w * (share * sums[i, 5] + my * my)
    return value, gx, gy, hxx, hxy, hyy
