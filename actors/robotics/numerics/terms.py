"""The constraint functions of eqs. (2)-(4) at one point: value, gradient and Hessian, all exact; f6 without its kink.

Each constraint returns ``(value, d/dx, d/dy, d2/dxx, d2/dxy, d2/dyy)`` and is satisfied where its value is <= 0.
"""

from __future__ import annotations

import math

from .compiled import inlined, kernel

Term = tuple[float, float, float, float, float, float]
_TINY = 1e-9  # keeps the direction defined at distance zero


@kernel
def stay_near(x: float, y: float, cx: float, cy: float, radius: float) -> Term:
    """f3, and the argument of f6: distance to (cx, cy) minus ``radius``."""
    dx, dy = x - cx, y - cy
    d = max(math.sqrt(dx * dx + dy * dy), _TINY)
    bend = 1.0 / d
    nx, ny = bend * dx, bend * dy
    return d - radius, nx, ny, bend * ny * ny, -bend * nx * ny, bend * nx * nx


@kernel
def keep_away(x: float, y: float, cx: float, cy: float, distance: float) -> Term:
    """f5 with its margin: ``distance`` minus the distance to (cx, cy)."""
    value, gx, gy, hxx, hxy, hyy = stay_near(x, y, cx, cy, distance)
    return -value, -gx, -gy, -hxx, -hxy, -hyy


@kernel
def keep_away_uncertain(
    x: float, y: float, cx: float, cy: float, cxx: float, cxy: float, cyy: float, distance: float, margin: float,
) -> Term:  # fmt: skip
    """f4 + alpha * sigma_4 of eqs. (2) and (4): the margin is the deviation along the line of sight.

    In polar coordinates around the obstacle, h(r, a) = distance - r + margin * sigma(a), where
    sigma^2(a) = n(a)^T C n(a); derivatives are taken there and rotated back.
    """
    dx, dy = x - cx, y - cy
    r = max(math.sqrt(dx * dx + dy * dy), _TINY)
    inverse = 1.0 / r
    nx, ny = inverse * dx, inverse * dy
    if dx == 0.0 and dy == 0.0:
        nx, ny = 1.0, 0.0
    tx, ty = -ny, nx
    along = nx * (cxx * nx + cxy * ny) + ny * (cxy * nx + cyy * ny)
    across = tx * (cxx * tx + cxy * ty) + ty * (cxy * tx + cyy * ty)
    mixed = tx * (cxx * nx + cxy * ny) + ty * (cxy * nx + cyy * ny)
    sigma = math.sqrt(max(along, 1e-18))
    steep = 1.0 / sigma
    slope = steep * mixed  # d sigma / d a
    bend = steep * (across - along - slope * slope)  # d2 sigma / d a2
    radial, tangential = -1.0, margin * slope * inverse
    h_rt = -inverse * tangential
    h_tt = inverse * (margin * bend * inverse - 1.0)
    return (
        distance - r + margin * sigma,
        radial * nx + tangential * tx,
        radial * ny + tangential * ty,
        2.0 * h_rt * nx * tx + h_tt * tx * tx,
        h_rt * (nx * ty + ny * tx) + h_tt * tx * ty,
        2.0 * h_rt * ny * ty + h_tt * ty * ty,
    )


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
