"""The constraint functions of eqs. (2)-(4) at one point: value, gradient and Hessian, all exact; f6 without its kink.

Each constraint returns a ``Term`` and is satisfied where its value is <= 0; points have two or three dimensions.
"""

from __future__ import annotations

import math

from .compiled import borrower, inlined
from .vectors import (
    Symmetric,
    Term,
    Vector,
    dot,
    frame_of,
    less,
    packed,
    replaced,
    row,
    scaled,
    spread,
    squared,
    zero_matrix,
    zero_term,
)

_TINY = 1e-9  # keeps the direction defined at distance zero


@borrower
def stay_near(at: Vector, centre: Vector, radius: float) -> Term:
    """f3, and the argument of f6: distance to ``centre`` minus ``radius``."""
    d, offset, term = len(at), less(at, centre), zero_term(at)
    distance = max(math.sqrt(squared(offset)), _TINY)
    bend = 1.0 / distance
    n = scaled(bend, offset)
    for i in range(d):
        term = replaced(term, 1 + i, n[i])
        for j in range(i, d):
            if i == j:  # bend (1 - n_i^2), without cancellation
                other = 0 if i > 0 else 1
                curvature = bend * n[other] * n[other]
                for k in range(other + 1, d):
                    if k != i:
                        curvature += bend * n[k] * n[k]
            else:
                curvature = -bend * n[i] * n[j]
            term = replaced(term, 1 + d + packed(d, i, j), curvature)
    return replaced(term, 0, distance - radius)


@borrower
def keep_away(at: Vector, centre: Vector, distance: float) -> Term:
    """f5 with its margin: ``distance`` minus the distance to ``centre``."""
    return scaled(-1.0, stay_near(at, centre, distance))


@borrower
def keep_level(at: Vector, level: float, sign: float) -> Term:
    """f7: the height above a ``level`` with ``sign`` 1, or below it with -1."""
    term, last = zero_term(at), len(at) - 1
    return replaced(replaced(term, 0, sign * (at[last] - level)), 1 + last, sign)


@borrower
def keep_away_uncertain(at: Vector, centre: Vector, covariance: Symmetric, distance: float, margin: float) -> Term:
    """f4 + alpha * sigma_4 of eqs. (2) and (4): the margin is the deviation along the line of sight.

    In an orthonormal frame of the line of sight n and the directions t_k across it, h = distance - r + margin *
    sigma(n), where sigma^2(n) = n^T C n; a step along t_k turns n by 1 / r towards t_k.  Derivatives are taken there
    and rotated back.
    """
    d, offset, term = len(at), less(at, centre), zero_term(at)
    r = max(math.sqrt(squared(offset)), _TINY)
    inverse = 1.0 / r
    n = scaled(inverse, offset)
    nowhere = True
    for c in range(d):
        nowhere = nowhere and offset[c] == 0.0
    if nowhere:
        n = replaced(n, 0, 1.0)
    frame = frame_of(n, zero_matrix(at))
    seen = spread(covariance, n)
    along = dot(n, seen)
    sigma = math.sqrt(max(along, 1e-18))
    steep = 1.0 / sigma
    gradient = replaced(n, 0, -1.0)  # in the frame; h is linear in r
    curved, slopes = zero_matrix(at), n
    for k in range(1, d):
        tangent = row(n, frame, k)
        slope = steep * dot(tangent, seen)  # d sigma / d a_k
        slopes = replaced(slopes, k, slope)
        gradient = replaced(gradient, k, margin * slope * inverse)
        curved = replaced(curved, k, -inverse * gradient[k])
        across = spread(covariance, tangent)
        for m in range(1, k + 1):
            bend = dot(row(n, frame, m), across)  # steep times this, below: d2 sigma / d a_k d a_m
            if m == k:
                bend = steep * (bend - along - slope * slope)
                bend = inverse * (margin * bend * inverse - 1.0)
            else:
                bend = steep * (bend - slope * slopes[m])
                bend = inverse * (margin * bend * inverse)
            curved = replaced(replaced(curved, k * d + m, bend), m * d + k, bend)
    for i in range(d):
        slope = gradient[0] * n[i]
        for k in range(1, d):
            slope += gradient[k] * frame[k * d + i]
        term = replaced(term, 1 + i, slope)
        for j in range(i, d):
            place, bend = 1 + d + packed(d, i, j), 0.0
            for k in range(1, d):
                if i == j:
                    turn = 2.0 * curved[k] * n[i] * frame[k * d + i]
                else:
                    turn = curved[k] * (n[i] * frame[k * d + j] + n[j] * frame[k * d + i])
                bend = turn if k == 1 else bend + turn
            for k in range(1, d):
                for m in range(1, d):
                    bend += curved[k * d + m] * frame[k * d + i] * frame[m * d + j]
            term = replaced(term, place, bend)
    return replaced(term, 0, distance - r + margin * sigma)


@inlined
def smoothed(gamma: float, g: float, mu: float) -> tuple[float, float]:
    """f6 = max(0, g) of eq. (5) on the central path: t, which replaces f6, and t - g.

    f6 has a kink, and is the least t with t >= 0 and t >= g.  With both bounds in the barrier, its cost becomes

        F(g) = min over t of  gamma t - mu log t - mu log(t - g),

    which tends to gamma f6 with the barrier parameter.  At the minimum, gamma = mu / t + mu / (t - g), that is
    gamma t^2 - (gamma g + 2 mu) t + mu g = 0, whose larger root keeps both bounds:

        t     = (2 mu + gamma g + root) / (2 gamma),  root = sqrt((gamma g)^2 + 4 mu^2)
        t - g = (2 mu - gamma g + root) / (2 gamma)

    One of the two is a sum of positive numbers; the other one, whose digits would cancel, follows from it by the
    condition of the minimum.  As t is optimal, F' = mu / (t - g); and as the condition implies that dt/dg = t^2 / (t^2
    + (t - g)^2), F'' = mu / (t^2 + (t - g)^2).
    """
    root = math.sqrt(gamma * g * gamma * g + 4.0 * mu * mu)
    if g > 0.0:
        t = (gamma * g + 2.0 * mu + root) / (2.0 * gamma)
        return t, mu * t / (gamma * t - mu)
    over = (2.0 * mu - gamma * g + root) / (2.0 * gamma)
    return mu * over / (gamma * over - mu), over
