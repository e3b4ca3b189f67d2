"""The constraint functions of eqs. (2)-(4) at one point: value, gradient and Hessian, all exact.

Each returns ``(value, d/dx, d/dy, d2/dxx, d2/dxy, d2/dyy)`` and is satisfied where its value is <= 0.
"""

from __future__ import annotations

import math

from .compiled import kernel

Term = tuple[float, float, float, float, float, float]
_TINY = 1e-9  # keeps the direction defined at distance zero


@kernel
def stay_near(x: float, y: float, cx: float, cy: float, radius: float) -> Term:
    """f3, and f6's inside: distance to (cx, cy) less ``radius``."""
    dx, dy = x - cx, y - cy
    d = max(math.sqrt(dx * dx + dy * dy), _TINY)
    nx, ny = dx / d, dy / d
    return d - radius, nx, ny, ny * ny / d, -nx * ny / d, nx * nx / d


@kernel
def keep_away(x: float, y: float, cx: float, cy: float, distance: float) -> Term:
    """f5 with its margin: ``distance`` less the distance to (cx, cy)."""
    value, gx, gy, hxx, hxy, hyy = stay_near(x, y, cx, cy, distance)
    return -value, -gx, -gy, -hxx, -hxy, -hyy


@kernel
def keep_away_uncertain(
    x: float,
    y: float,
    cx: float,
    cy: float,
    cxx: float,
    cxy: float,
    cyy: float,
    distance: float,
    margin: float,
) -> Term:
    """f4 + alpha * sigma_4 of eqs. (2) and (4): the margin is the deviation along the line of sight.

    In polar coordinates around the obstacle, h(r, a) = distance - r + margin * sigma(a), where
    sigma^2(a) = n(a)^T C n(a); derivatives are taken there and turned back.
    """
    dx, dy = x - cx, y - cy
    r = max(math.sqrt(dx * dx + dy * dy), _TINY)
    nx, ny = dx / r, dy / r
    if dx == 0.0 and dy == 0.0:
        nx, ny = 1.0, 0.0
    tx, ty = -ny, nx
    along = nx * (cxx * nx + cxy * ny) + ny * (cxy * nx + cyy * ny)
    across = tx * (cxx * tx + cxy * ty) + ty * (cxy * tx + cyy * ty)
    mixed = tx * (cxx * nx + cxy * ny) + ty * (cxy * nx + cyy * ny)
    sigma = math.sqrt(max(along, 1e-18))
    slope = mixed / sigma  # d sigma / d a
    bend = (across - along) / sigma - slope * slope / sigma  # d2 sigma / d a2
    radial, tangential = -1.0, margin * slope / r
    h_rt = -margin * slope / (r * r)
    h_tt = margin * bend / (r * r) - 1.0 / r
    return (
        distance - r + margin * sigma,
        radial * nx + tangential * tx,
        radial * ny + tangential * ty,
        2.0 * h_rt * nx * tx + h_tt * tx * tx,
        h_rt * (nx * ty + ny * tx) + h_tt * tx * ty,
        2.0 * h_rt * ny * ty + h_tt * ty * ty,
    )
