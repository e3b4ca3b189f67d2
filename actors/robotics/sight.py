"""Lines of sight: their noise, and what stands on the ground between two points in space."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence


def disturbed(
    offset: Sequence[float], level: float, length: float, along: float, across: float, upright: float = 0.0
) -> tuple[float, ...]:
    """A way (d,) to a target with errors: ``along`` the line of sight, level and ``across`` it, and ``upright`` to
    both; ``level`` is its length as seen from above, and ``length`` the whole one."""
    dx, dy = offset[0], offset[1]
    lx, ly = (dx / level, dy / level) if level > 0.0 else (1.0, 0.0)
    if len(offset) == 2:
        return dx + along * lx - across * ly, dy + along * ly + across * lx
    dz = offset[2]
    nx, ny, nz = (dx / length, dy / length, dz / length) if length > 0.0 else (1.0, 0.0, 0.0)
    return (
        dx + along * nx - across * ly - upright * nz * lx,
        dy + along * ny + across * lx - upright * nz * ly,
        dz + along * nz + upright * (nx * lx + ny * ly),
    )


def is_hidden(
    eye: Sequence[float], target: Sequence[float], cylinders: Iterable[tuple[float, float, float, float]]
) -> bool:
    """Whether a line of sight between two points (x, y, z) goes through an upright cylinder.

    A cylinder is (x, y, radius, height) and stands on the plane z = 0.  A line that only touches one is not hidden.
    """
    (ex, ey, ez), (tx, ty, tz) = eye, target
    dx, dy, dz = tx - ex, ty - ey, tz - ez
    a = dx * dx + dy * dy
    for x, y, radius, height in cylinders:
        # Seen from above, the points eye + s (target - eye) in the disk are those with s between the roots of
        # a s^2 + 2 b s + c; the lowest of them is an end.
        b = (ex - x) * dx + (ey - y) * dy
        c = (ex - x) * (ex - x) + (ey - y) * (ey - y) - radius * radius
        root = b * b - a * c
        if a == 0.0:
            first, last = (0.0, 1.0) if c < 0.0 else (1.0, 0.0)
        elif root <= 0.0:
            continue
        else:
            half = math.sqrt(root)
            first, last = max(0.0, (-b - half) / a), min(1.0, (-b + half) / a)
        if first < last and min(ez + first * dz, ez + last * dz) < height:
            return True
    return False
