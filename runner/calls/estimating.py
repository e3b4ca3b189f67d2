"""How probable it is that a run breaks a property: what ``epicycle.rare`` and the command do."""

from __future__ import annotations

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Unpack

from ..build.model import Model
from ..search import RareEvent, monitor_named
from ..search import rare as search
from .run_spec import Changes, seconds
from .running import loaded

__all__ = ["RareEvent", "rare"]

_GUIDE = "guide"  # the name of one that is made of a text


def rare(
    model: Model | str | Path,
    monitor: str,
    *,
    guide: str | None = None,
    runs: int = 200,
    repetitions: int = 10,
    seed: int | None = None,
    until: float | str | None = None,
    out: str | Path | None = None,
    progress: Callable[[int, int], None] | None = None,
    **changes: Unpack[Changes],
) -> RareEvent:
    """Estimate how probable it is that a run breaks a monitor, or a property that is given as a text, however rare.

    Runs whose robustness falls to a level go on from there many times over (importance splitting): ``runs`` from each
    level, in ``repetitions`` that are independent.  ``guide`` is the monitor or property whose robustness counts, by
    default the same.  ``set``, ``disturb`` and the other options of ``load`` change the model first.  In a ``folder``,
    each repetition is noted, so that an estimate that was killed continues there.

    >>> epicycle.rare("mm1", "always server.size < 40", until="1 h").interval
    """
    made = loaded(model, changes)
    made = copy.copy(made) if isinstance(model, Model) else made
    monitor = monitor_named(made, monitor)
    return search(
        made,
        monitor,
        guide=None if guide is None else monitor_named(made, guide, _GUIDE),
        runs=runs,
        repetitions=repetitions,
        seed=seed,
        until=seconds("until", until),
        folder=None if out is None else Path(out),
        tell=progress,
    )
