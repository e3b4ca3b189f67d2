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
    r = np.empty(count)
    ux = np.empty(count)
    uy = np.empty(count)
    for i in range(count):
        dx, dy = x - sigma_positions[i, 0], y - sigma_positions[i, 1]
        r[i] = max(math.hypot(dx, dy), 1e-9)
        ux[i], uy[i] = dx / r[i], dy / r[i]
    value = gx = gy = hxx = hxy = hyy = 0.0
    exponent = np.empty(count)
    for i in range(count):
        if weights[i] == 0.0:
            continue
        smallest = math.inf
        for j in range(count):
            exponent[j] = (r[i] - r[j]) ** 2 / (2.0 * variance) + others_distance[i, j]
            if weights[j] > 0.0:
                smallest = min(smallest, exponent[j])
        total = mx = my = mxx = mxy = myy = 0.0
        for j in range(count):
            if weights[j] == 0.0:
                continue
            q = weights[j] * math.exp(smallest - exponent[j])
            total += q
            difference = r[i] - r[j]
            ex = difference * (ux[i] - ux[j]) / variance
            ey = difference * (uy[i] - uy[j]) / variance
            # Hessian of E_ij less its outer gradient product; (I - u u^T)/r is the Hessian of a range.
            exx = ((ux[i] - ux[j]) ** 2 + difference * ((1 - ux[i] ** 2) / r[i] - (1 - ux[j] ** 2) / r[j])) / variance
            eyy = ((uy[i] - uy[j]) ** 2 + difference * ((1 - uy[i] ** 2) / r[i] - (1 - uy[j] ** 2) / r[j])) / variance
            exy = (
                (ux[i] - ux[j]) * (uy[i] - uy[j]) + difference * (-ux[i] * uy[i] / r[i] + ux[j] * uy[j] / r[j])
            ) / variance
            mx += q * ex
            my += q * ey
            mxx += q * (exx - ex * ex)
            mxy += q * (exy - ex * ey)
            myy += q * (eyy - ey * ey)
        mx /= total
        my /= total
        w = weights[i]
        value += w * (math.log(total) - smallest)
        gx -= w * mx
        gy -= w * my
        hxx -= w * (mxx / total + mx * mx)
        hxy -= w * (mxy / total + mx * my)
        hyy -= w * (myy / total + my * my)
    return value, gx, gy, hxx, hxy, hyy
