"""What the methods of a user's part give: of the right shape, or an error that names the method."""

from __future__ import annotations

from typing import Any

from ..core import Configurable, ParameterError, brief, counted


class MethodError(ParameterError):
    """A method of a part gives something else than it should."""


def numbers_of(part: Configurable, method: str, found: Any, count: int | None = None, because: str = "") -> list[float]:
    """What a method gave, as floats; raises ``MethodError`` unless these are ``count`` numbers."""
    try:
        numbers = [float(each) for each in found]
    except (TypeError, ValueError):
        expected = "a list of numbers" if count is None else f"a list of {counted(count, 'number')}{because}"
        raise MethodError(f"{type(part).__name__}.{method} gave {brief(found)}; expected {expected}") from None
    if count is not None and len(numbers) != count:
        raise MethodError(
            f"{type(part).__name__}.{method} gave {counted(len(numbers), 'number')}; expected {count}{because}"
        )
    return numbers


def covariance_of(part: Configurable, method: str, found: Any, count: int) -> list[list[float]]:
    """What a method gave, as a covariance of ``count`` numbers; raises ``MethodError`` unless it may be one."""
    try:
        rows = [[float(each) for each in row] for row in found]
    except (TypeError, ValueError):
        rows = []
    shaped = [len(row) for row in rows] == [count] * count
    if not shaped or not all(rows[i][i] >= 0.0 for i in range(count)):
        raise MethodError(
            f"{type(part).__name__}.{method} gave {brief(found)}; expected a covariance: "
            f"{counted(count, 'row')} of {counted(count, 'number')}, with variances of at least 0 on the diagonal"
        )
    return rows
