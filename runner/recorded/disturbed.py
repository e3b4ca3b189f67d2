"""A recording that was disturbed: what came of its messages."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ..support.shown import short
from ..support.tables import Table, Tabled


@dataclass(repr=False)
class Disturbed(Tabled):
    """A recording that was disturbed: messages by topic, before and after, and what the aspects counted."""

    recording: Path
    out: Path
    came: dict[str, int]
    delivered: dict[str, int]
    aspects: dict[str, dict[str, float | None]]
    left_out: list[str]  # aspects and settings of the disturbances that are not for recordings
    seed: int

    def facts(self) -> dict[str, Any]:
        """Everything that is known of it, as JSON-like data."""
        return {**asdict(self), "recording": str(self.recording), "out": str(self.out)}

    def _caption(self) -> str:
        came, delivered = (sum(each.values()) for each in (self.came, self.delivered))
        left_out = f"; not for recordings, and left out: {', '.join(self.left_out)}" if self.left_out else ""
        return f"{self.recording}: {came:,} messages came, {delivered:,} were delivered, seed {self.seed}{left_out}"

    def _tables(self) -> list[Table]:
        topics = [(topic, f"{came:,}", f"{self.delivered[topic]:,}") for topic, came in self.came.items()]
        figures = [
            (name, what, "-" if figure is None else short(figure))
            for name, each in self.aspects.items()
            for what, figure in each.items()
        ]
        return [Table(("topic", "came", "delivered"), topics), Table(("aspect", "figure", "value"), figures)]
