"""What a run leaves behind: signals, metrics, counts and the log."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from epicycle.actors import Tag, to_seconds

from .encoding import scalars
from .log import EventLog


@dataclass
class Signal:
    """What one port sent: tags and tokens, in order."""

    name: str
    tags: list[Tag] = field(default_factory=list)
    tokens: list[Any] = field(default_factory=list)

    def add(self, tag: Tag, token: Any) -> None:
        """Append a token."""
        self.tags.append(tag)
        self.tokens.append(token)

    @property
    def times(self) -> list[float]:
        """The times in seconds."""
        return [to_seconds(tag.time) for tag in self.tags]


class Reduction:
    """A number that is kept up to date over tokens: last, first, min, max, sum, mean or count."""

    def __init__(self, take: str) -> None:
        self.take = take
        self.count = 0
        self._value: Any = None
        self._total: Any = 0

    def add(self, token: Any) -> None:
        """Take in a token."""
        self.count += 1
        if self.take in ("sum", "mean"):
            self._total += token
        elif self._value is None or self.take == "last":
            self._value = token
        elif self.take == "min":
            self._value = _nan_or(min, self._value, token)
        elif self.take == "max":
            self._value = _nan_or(max, self._value, token)

    @property
    def value(self) -> Any:
        """The number; None where no token came and there is nothing to say."""
        if self.take == "count":
            return self.count
        if self.take == "sum":
            return self._total
        if self.count == 0:
            return None
        if self.take == "mean":
            return self._total / self.count
        return self._value


def _nan_or(choose: Callable[..., Any], first: Any, second: Any) -> Any:
    """The lesser or greater of two numbers; if one of them is NaN there is no such thing, whatever the order."""
    return math.nan if math.isnan(first) or math.isnan(second) else choose(first, second)


@dataclass
class Results:
    """The outcome of one run."""

    model: str
    seed: int
    parameters: dict[str, object]
    metrics: dict[str, Any]
    aspects: dict[str, dict[str, int]]
    signals: dict[str, Signal]
    log: EventLog
    end: float  # s, the last tag
    stopped: str  # why the run ended
    firings: int
    wall_time: float  # s

    @property
    def events(self) -> int:
        """The number of records in the event log."""
        return self.log.count

    @property
    def digest(self) -> str:
        """SHA-256 of the event log."""
        return self.log.digest

    def table(self) -> dict[str, list[Any]]:
        """All recorded numbers in long form, the columns of ``signals.parquet``."""
        table: dict[str, list[Any]] = {"time": [], "microstep": [], "signal": [], "field": [], "value": []}
        for name, signal in self.signals.items():
            for tag, token in zip(signal.tags, signal.tokens, strict=True):
                for place, value in scalars(token):
                    table["time"].append(to_seconds(tag.time))
                    table["microstep"].append(tag.microstep)
                    table["signal"].append(name)
                    table["field"].append(place)
                    table["value"].append(value)
        return table
