"""What sensors measure of a target, and how badly: what a ``Sensor`` draws from, and what a filter fuses with."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

from ..core import Configurable, Parameter
from ..core.elementary import distance, log

RELATIVE_POSITION = "relative_position"
RANGE = "range"
Rows = Sequence[Sequence[float]]


class SensorModel(Configurable):
    """What a sensor measures of a target: k numbers with normal noise.

    ``target`` is its state, position and velocity (2 d).  ``observer`` is that of the robot: its position, followed by
    the heading of a ``Pose``, the rest of a ``MotionState``, or the velocity.
    """

    def h(self, target: Sequence[float], observer: Sequence[float]) -> Sequence[float]:
        """The k numbers that a sensor without noise measures."""
        raise NotImplementedError(f"{type(self).__name__} has no h()")

    def noise(self, target: Sequence[float], observer: Sequence[float]) -> Rows:
        """R, the covariance (k, k) of their errors."""
        raise NotImplementedError(f"{type(self).__name__} has no noise()")

    def difference(self, one: Sequence[float], other: Sequence[float]) -> Sequence[float]:
        """One measurement minus another one; angles need their own."""
        return [a - b for a, b in zip(one, other, strict=True)]


class _RelativePosition(SensorModel):
    """The way from the observer, a position, to the target; its noise is an ellipse along the line of sight."""

    along = Parameter(float, 0.2, unit="m", min=0, doc="standard deviation along the line of sight, sigma_d")
    across = Parameter(float, 2.0, unit="m", min=0, doc="standard deviation across the line of sight, sigma_b")

    def h(self, target: Sequence[float], observer: Sequence[float]) -> Sequence[float]:
        return _offset(target, observer)

    def noise(self, target: Sequence[float], observer: Sequence[float]) -> Rows:
        sight, a, b = direction(_offset(target, observer)), self.along * self.along, self.across * self.across
        return [[(a - b) * m * n + (b if i == j else 0.0) for j, n in enumerate(sight)] for i, m in enumerate(sight)]


class _Range(SensorModel):
    """The distance of the target from the observer, a position: z of eq. (1)."""

    along = Parameter(float, 0.2, unit="m", min=0, doc="standard deviation")

    def h(self, target: Sequence[float], observer: Sequence[float]) -> Sequence[float]:
        offset = _offset(target, observer)
        return [distance(offset, [0.0] * len(offset))]

    def noise(self, target: Sequence[float], observer: Sequence[float]) -> Rows:
        return [[self.along * self.along]]


@lru_cache(64)
def model_of(kind: str, along: float, across: float) -> SensorModel:
    """The model of a ``Measurement`` of a kind."""
    return _Range(along=along) if kind == RANGE else _RelativePosition(along=along, across=across)


def _offset(target: Sequence[float], observer: Sequence[float]) -> list[float]:
    """From observer to target; of the two, one in the plane is on the ground."""
    d = len(target) // 2
    size = max(d, len(observer))
    there, here = [*target[:d], 0.0][:size], [*observer, 0.0][:size]
    return [a - b for a, b in zip(there, here, strict=True)]


def direction(offset: Sequence[float]) -> list[float]:
    """The unit vector; along the x axis if there is none."""
    length = distance(offset, [0.0] * len(offset))
    return [each / length for each in offset] if length > 0.0 else [1.0, *[0.0] * (len(offset) - 1)]


def root_of(covariance: Rows) -> list[list[float]]:
    """The lower Cholesky factor; a pivot that is not positive counts as zero."""
    root: list[list[float]] = []
    for i, row in enumerate(covariance):
        root.append([0.0] * len(row))
        for j in range(i + 1):
            left = float(row[j])
            for k in range(j):
                left -= root[i][k] * root[j][k]
            if i == j:
                root[i][i] = math.sqrt(max(left, 0.0))
            elif root[j][j] > 0.0:
                root[i][j] = left / root[j][j]
    return root


def log_density(error: Sequence[float], covariance: Rows) -> float:
    """The logarithm of a normal density, without its constant."""
    root, solved, total = root_of(covariance), [0.0] * len(error), 0.0
    for i, row in enumerate(root):
        left = error[i]
        for k in range(i):
            left -= row[k] * solved[k]
        if not row[i] > 0.0:
            return -math.inf
        solved[i] = left / row[i]
        total -= 0.5 * solved[i] * solved[i] + log(row[i])
    return total
