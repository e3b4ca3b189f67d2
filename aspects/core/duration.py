"""Parameters that may be distributions: laws, durations, and the times that firings take."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, TypeAlias

from epicycle.actors import (
    REQUIRED,
    Configurable,
    Distribution,
    MappingParameter,
    Parameter,
    ParameterError,
    Stream,
)

from .execution import Job

Duration: TypeAlias = float | Distribution
FiringTime: TypeAlias = Duration | Mapping[str, Duration]  # by input port


class LawParameter(Parameter[str | Distribution]):
    """A distribution, or the name of a familiar one: ``normal``, or ``{type: Triangular, low: -1}``."""

    def __init__(self, familiar: Iterable[str], default: Any = REQUIRED, *, doc: str = "") -> None:
        super().__init__(str, default, doc=doc)
        self.forms = (Parameter(str, choices=tuple(familiar)), Parameter(Distribution))

    def describe_type(self) -> str:
        return f"{', '.join(self.forms[0].choices)}, or distribution"

    def convert(self, value: object) -> str | Distribution | None:
        converted: str | Distribution | None = self.forms[isinstance(value, (Mapping, Configurable))].convert(value)
        return converted


def law(value: str | Distribution, familiar: Mapping[str, Distribution]) -> Distribution:
    """What a ``LawParameter`` with these names says."""
    return familiar[value] if isinstance(value, str) else value


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


class FiringTimeParameter(DurationParameter):
    """How long a firing takes: a duration, or one for each input port that costs time, ``{trigger: 60 ms}``.

    A duration alone is for firings in which the actor has work to do: for a wake-up, or a token at a port that
    triggers it.  What it only takes note of costs nothing.  With durations by port a firing takes the longest of those
    of the ports at which tokens came; other ports, and wake-ups, cost nothing.
    """

    def __init__(self, default: Any = REQUIRED, *, doc: str = "") -> None:
        super().__init__(default, doc=doc)
        self._by_port = MappingParameter(DurationParameter())
        self.forms = (*self.forms, self._by_port)

    def describe_type(self) -> str:
        return "time, distribution, or {port: time}"

    def _expected(self) -> str:
        return "a time in s >= 0, a distribution, or these by input port"

    def convert(self, value: object) -> FiringTime | None:  # type: ignore[override]
        if isinstance(value, Mapping) and value and "type" not in value:
            by_port: Mapping[str, Duration] | None = self._by_port.convert(value)
            return by_port
        return super().convert(value)


def time_needed(time: FiringTime, job: Job, random: Stream) -> float | None:
    """How long a firing takes (s); None: there is nothing to do in it that would take time."""
    if not isinstance(time, Mapping):
        return drawn(time, random) if job.is_triggered else None
    come = {port.name for port in job.arrivals}
    return max((drawn(time[port], random) for port in sorted(come & time.keys())), default=None)
