"""Durations: parameters that are a time or a distribution of times."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

from epicycle.actors import REQUIRED, Configurable, Distribution, Parameter, ParameterError, Stream

Duration: TypeAlias = float | Distribution


class DurationParameter(Parameter[Duration]):
    """``2 s``, or ``{type: Exponential, mean: 2 s}``."""

    def __init__(self, default: Any = REQUIRED, *, doc: str = "") -> None:
        super().__init__(float, default, min=0.0, unit="s", doc=doc)
        self._of_law: Parameter[Distribution] = Parameter(Distribution, unit="s")
        self.forms = (Parameter(float, min=0.0, unit="s"), self._of_law)

    def describe_type(self) -> str:
        return "time or distribution"

    def _expected(self) -> str:
        return "a time in s >= 0, or a distribution"

    def convert(self, value: object) -> Duration | None:
        if isinstance(value, (Mapping, Configurable)):
            return self._of_law.convert(value)
        if isinstance(value, str) and not any(letter.isdigit() for letter in value):
            raise ParameterError(f"{value!r} is not a time in s, nor a distribution {{type: ..., ...}}")
        return super().convert(value)


def drawn(duration: Duration, random: Stream) -> float:
    """A time in seconds; a number is drawn only from a distribution, and counts as 0 where it is negative."""
    return max(0.0, float(duration.draw(random))) if isinstance(duration, Distribution) else duration
