"""The calls of a program: load, run, study, compare, view, plot, draw and save.  The commands use them, too.

``epicycle`` itself offers all of these.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .calibrating import Calibrated, calibrate, calibrated
    from .comparing import Away, Comparison, Difference, compare, compared
    from .disturbing import Disturbed, disturb
    from .estimating import RareEvent, rare
    from .explaining import Explained, explain, explained
    from .falsifying import Falsified, falsified, falsify
    from .fitting import Fit, fit
    from .optimising import Optimised, optimise, optimised
    from .picturing import Picture, Pictures, draw, plot, save
    from .run_spec import Changes, OpenedRun, RunSpec, opened, seconds
    from .running import Done, again, load, perform, run, watched
    from .studying import study
    from .viewing import Page, recorded, view

__all__ = [
    "Away",
    "Calibrated",
    "Changes",
    "Comparison",
    "Difference",
    "Disturbed",
    "Done",
    "Explained",
    "Falsified",
    "Fit",
    "OpenedRun",
    "Optimised",
    "Page",
    "Picture",
    "Pictures",
    "RareEvent",
    "RunSpec",
    "again",
    "calibrate",
    "calibrated",
    "compare",
    "compared",
    "disturb",
    "draw",
    "explain",
    "explained",
    "falsified",
    "falsify",
    "fit",
    "load",
    "opened",
    "optimise",
    "optimised",
    "perform",
    "plot",
    "rare",
    "recorded",
    "run",
    "save",
    "seconds",
    "study",
    "view",
    "watched",
]

_HOMES = {
    "calibrating": ("Calibrated", "calibrate", "calibrated"),
    "comparing": ("Away", "Comparison", "Difference", "compare", "compared"),
    "disturbing": ("Disturbed", "disturb"),
    "estimating": ("RareEvent", "rare"),
    "explaining": ("Explained", "explain", "explained"),
    "falsifying": ("Falsified", "falsified", "falsify"),
    "optimising": ("Optimised", "optimise", "optimised"),
    "fitting": ("Fit", "fit"),
    "picturing": ("Picture", "Pictures", "draw", "plot", "save"),
    "run_spec": ("Changes", "OpenedRun", "RunSpec", "opened", "seconds"),
    "running": ("Done", "again", "load", "perform", "run", "watched"),
    "studying": ("study",),
    "viewing": ("Page", "recorded", "view"),
}


def __getattr__(name: str) -> Any:
    # On first use: a run needs neither studies nor drawing.
    home = next((home for home, names in _HOMES.items() if name in names), None)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{home}", __name__), name)
