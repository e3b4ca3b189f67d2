"""Recorded data that pass a disturbance: what ``epicycle.disturb`` and the command do."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ..language.settings import Setting
from ..recorded import Passed, pass_recording
from ..shown import short
from ..tables import Table, Tabled


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


def disturb(
    recording: str | Path,
    disturbance: str | Path | Iterable[str | Path],
    out: str | Path,
    *,
    at: str | Iterable[str] = (),
    set: Iterable[str | Setting] | Mapping[str, object] = (),
    seed: int = 0,
    types: Iterable[type] = (),
) -> Disturbed:
    """Write a recording, an MCAP or CSV file, as it is after its messages have passed a disturbance.

    ``at`` are topics, or patterns of them, in place of the ports that the disturbance names.  ``set`` gives parameters
    of the disturbance their values.  Equal arguments give equal files.  Raises ``EpicycleError``.

    >>> epicycle.disturb("recording.mcap", "wifi_burst", "out.mcap", at="/robot*/plan", seed=3)
    """
    disturbances = [disturbance] if isinstance(disturbance, (str, Path)) else disturbance
    patterns = [at] if isinstance(at, str) else at
    source, path = Path(recording), Path(out)
    passed = pass_recording(source, path, disturbances, at=patterns, set=set, seed=seed, types=types)
    return Disturbed(source, path, passed)
