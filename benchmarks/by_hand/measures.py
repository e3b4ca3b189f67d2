"""What the programs measure with: a number that holds over time."""

from __future__ import annotations

import simpy


class Level:
    """A number that changes now and then, and its mean over time."""

    def __init__(self, environment: simpy.Environment) -> None:
        self.environment = environment
        self.value = self.most = 0
        self.area = self.since = 0.0

    def add(self, change: int) -> None:
        """Change the number."""
        self.area += self.value * (self.environment.now - self.since)
        self.since = self.environment.now
        self.value += change
        self.most = max(self.most, self.value)

    def mean(self) -> float:
        """The mean over time until now."""
        self.add(0)
        return self.area / self.environment.now


def mean(values: list[float]) -> float:
    """The mean of a list."""
    return sum(values) / len(values)
