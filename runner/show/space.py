"""Reads the spatial content of a run from tokens: positions, estimates, plans, lines of sight."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from epicycle.actors import EpicycleError

from ..results import Signal

Rows = NDArray[np.float64]

DEVIATIONS = 2.0  # shown around an estimate


def positions(signal: Signal) -> Rows:
    """The positions in a signal, shape (n, 2): the tokens' ``position`` from above, or tokens that are pairs x, y.

    Raises ``EpicycleError`` for other signals.
    """
    try:
        return np.array([_position(token) for token in signal.tokens], dtype=float).reshape(-1, 2)
    except (AttributeError, LookupError, TypeError, ValueError):
        raise EpicycleError(f"the tokens of {signal.name} have no 'position' and are not pairs x, y") from None


def _position(token: Any) -> Any:
    if hasattr(token, "position"):
        x, y = token.position[:2]
    else:
        x, y = token["position"] if isinstance(token, dict) else token
    return x, y


def ellipses(signal: Signal) -> Rows:
    """Estimates as x, y, half axes at two standard deviations, and the angle of the first in rad; shape (n, 5)."""
    rows = []
    for token in signal.tokens:
        spread, axes = np.linalg.eigh(np.asarray(token.covariance, dtype=float)[:2, :2])
        sizes = DEVIATIONS * np.sqrt(np.maximum(spread[::-1], 0.0))
        rows.append((*token.mean[:2], *sizes, np.arctan2(axes[1, 1], axes[0, 1])))
    return np.array(rows, dtype=float).reshape(-1, 5)


def tubes(signal: Signal, period: float, initial: float, growth: float) -> Rows:
    """Plans as circles x, y, radius, one for each control; the radius grows by ``growth`` at each step.

    A plan is rolled out as in the robots: each acceleration acts for one period.
    """
    rows = []
    for token in signal.tokens:
        position, velocity = np.array(token.state.position[:2]), np.array(token.state.velocity[:2])
        row = [*position, initial]
        for step, control in enumerate(np.asarray(token.controls, dtype=float)[:, :2], start=1):
            position = position + period * velocity + 0.5 * period * period * control
            velocity = velocity + period * control
            row += [*position, initial + growth * step]
        rows.append(row)
    longest = max(map(len, rows), default=3)
    return np.array([row + row[-3:] * ((longest - len(row)) // 3) for row in rows], dtype=float).reshape(-1, longest)


def sights(signal: Signal) -> tuple[list[int], Rows]:
    """Measurements of a relative position as lines from the sensor to its target, and the indices of their tokens."""
    found = [
        (number, (x, y, x + token.value[0], y + token.value[1]))
        for number, token in enumerate(signal.tokens)
        for x, y in [token.observer[:2]]
        if len(token.value) == len(token.observer)
    ]
    return [number for number, _ in found], np.array([row for _, row in found], dtype=float).reshape(-1, 4)
