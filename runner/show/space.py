"""Reads the spatial content of a run from tokens: positions, estimates, plans, lines of sight."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from epicycle.actors import EpicycleError

from ..execution.results import Signal
from .samples import Floats

DEVIATIONS = 2.0  # shown around an estimate


def positions(signal: Signal) -> Floats:
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


def ellipses(signal: Signal) -> Floats:
    """Estimates as x, y, half axes at two standard deviations, and the angle of the first in rad; shape (n, 5)."""
    return np.array([ellipse(token) for token in signal.tokens], dtype=float).reshape(-1, 5)


def ellipse(estimate: Any) -> tuple[float, ...]:
    """A row of ``ellipses``."""
    spread, axes = np.linalg.eigh(np.asarray(estimate.covariance, dtype=float)[:2, :2])
    sizes = DEVIATIONS * np.sqrt(np.maximum(spread[::-1], 0.0))
    return (*estimate.mean[:2], *sizes, np.arctan2(axes[1, 1], axes[0, 1]))


def has_tracks(signal: Signal) -> bool:
    """Whether the tokens are estimates of several targets."""
    return any(hasattr(token, "estimates") for token in signal.tokens[:1])


def tracked(signal: Signal) -> dict[str, tuple[list[int], Floats]]:
    """The ``ellipses`` of each track of such a signal, as ``_numbered`` gives them."""
    tokens = signal.tokens
    return _numbered(
        signal,
        ({n: ellipse(one) for n, one in zip(token.numbers, token.estimates, strict=True)} for token in tokens),
        5,
    )


def _numbered(
    signal: Signal, tokens: Iterable[Mapping[int, tuple[float, ...]]], width: int
) -> dict[str, tuple[list[int], Floats]]:
    """The rows of each number in tokens, by a name with it, and the indices of their tokens; where a number is missing
    after a token that has it, its row is NaN."""
    found: dict[int, list[tuple[int, tuple[float, ...]]]] = {}
    before: Iterable[int] = ()
    for index, rows in enumerate(tokens):
        for number in {*before, *rows}:
            found.setdefault(number, []).append((index, rows.get(number, (np.nan,) * width)))
        before = rows
    return {
        f"{signal.name}[{number}]": (
            [index for index, _ in rows],
            np.array([row for _, row in rows], dtype=float).reshape(-1, width),
        )
        for number, rows in sorted(found.items())
    }


def tubes(signal: Signal, period: float, initial: float, growth: float) -> Floats:
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


def sights(signal: Signal) -> dict[str, tuple[list[int], Floats]]:
    """Measurements of a relative position as lines from the sensor to its target, by name, with the indices of their
    tokens; the lines of a scan have a number each, as in ``_numbered``."""
    tokens = signal.tokens
    if not any(hasattr(token, "values") for token in tokens[:1]):
        found = [(n, _sight(t.observer, t.value)) for n, t in enumerate(tokens) if len(t.value) == len(t.observer)]
        rows = np.array([row for _, row in found], dtype=float).reshape(-1, 4)
        return {signal.name: ([index for index, _ in found], rows)}
    scans = ((token.observer, token.values if np.shape(token.values)[1:] == (2,) else ()) for token in tokens)
    return _numbered(signal, (dict(enumerate(_sight(observer, v) for v in seen)) for observer, seen in scans), 4)


def _sight(observer: Any, value: Any) -> tuple[float, ...]:
    return observer[0], observer[1], observer[0] + value[0], observer[1] + value[1]
