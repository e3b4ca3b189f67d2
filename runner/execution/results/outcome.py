"""Outcome: the value of a metric and the interval around it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

SHAKY = 0.45  # two standard deviations of the autocorrelation of 20 independent numbers


@dataclass(frozen=True)
class Interval:
    """A confidence interval of a mean from one run; ``autocorrelation`` is that of the batch means, at lag 1."""

    level: float
    low: float
    high: float
    batches: int
    autocorrelation: float

    @property
    def half(self) -> float:
        """Half of its width."""
        return (self.high - self.low) / 2

    @property
    def is_shaky(self) -> bool:
        """Whether the batch means are so correlated that only a longer run can be trusted."""
        return self.autocorrelation > SHAKY


@dataclass(frozen=True)
class Outcome:
    """The outcome of a metric.

    ``missing`` says why there is no value, ``unsure`` why there is no interval although one was requested; ``after``
    is the time (s) before which nothing counted; ``note`` is for people.
    """

    value: Any = None
    missing: str = ""
    interval: Interval | None = None
    unsure: str = ""
    after: float = 0.0
    note: str = ""

    def shown(self, show: Callable[[Any], str]) -> str:
        """The value with its interval, as ``show`` writes numbers."""
        if self.value is None:
            return "-"
        return show(self.value) + (f" ± {self.interval.half:.2g}" if self.interval is not None else "")

    def plain(self) -> dict[str, Any]:
        """Additions to the value, for programs."""
        found: dict[str, Any] = {"after": self.after} if self.after else {}
        found |= {key: said for key, said in (("missing", self.missing), ("unsure", self.unsure)) if said}
        return found if self.interval is None else {**found, **asdict(self.interval)}

    @property
    def remarks(self) -> list[str]:
        """Notes on the value, for people."""
        if self.missing:
            return [f"no value, because {self.missing}"]
        found = [self.note] if self.note else []
        if self.interval is not None:
            found.append(
                f"{100 * self.interval.level:.6g} % interval, autocorrelation {self.interval.autocorrelation:.2f}"
                + (" (too high: make the run longer)" if self.interval.is_shaky else "")
            )
        if self.unsure:
            found.append(f"no interval, because {self.unsure}")
        if self.after:
            found.append(f"after {self.after:.6g} s")
        return found
