"""A recording that was disturbed: what came of its messages."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from ..support.shown import short
from ..support.tables import Table, Tabled
from .passing import Passed


class Disturbed(Tabled):
    """A recording that was disturbed: messages of each topic, and what the aspects did, in ``passed``."""

    def __init__(self, source: Path, path: Path, passed: Passed) -> None:
        self.source = source
        self.path = path
        self.passed = passed

    def facts(self) -> dict[str, Any]:
        """Everything that is known of it, as JSON-like data."""
        return {"recording": str(self.source), "out": str(self.path), **asdict(self.passed)}

    def __repr__(self) -> str:
        return f"<Disturbed {self._caption()}>"

    def _caption(self) -> str:
        found = self.passed
        came, delivered = (sum(each.values()) for each in (found.came, found.delivered))
        left_out = f"; not for recordings, and left out: {', '.join(found.left_out)}" if found.left_out else ""
        return f"{self.source}: {came:,} messages came, {delivered:,} were delivered, seed {found.seed}{left_out}"

    def _tables(self) -> list[Table]:
        found = self.passed
        topics = [(topic, f"{came:,}", f"{found.delivered[topic]:,}") for topic, came in found.came.items()]
        figures = [
            (name, what, "-" if figure is None else short(figure))
            for name, each in found.aspects.items()
            for what, figure in each.items()
        ]
        return [Table(("topic", "came", "delivered"), topics), Table(("aspect", "figure", "value"), figures)]
