"""Epicycle from Python: load, run, study and compare models, draw and save the results.

>>> import epicycle
>>> results = epicycle.run("mm1", seed=3, set={"load": 0.9})
>>> results.metrics["mean_wait"]
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from epicycle.actors import EpicycleError
    from epicycle.bridges import gym, zoo
    from epicycle.runner import Model, ModelError, Results, Simulation, StudyResults, open_study
    from epicycle.runner.calls import (
        Calibrated,
        Comparison,
        Disturbed,
        Explained,
        Falsified,
        Fit,
        Optimised,
        Page,
        Picture,
        RareEvent,
        calibrate,
        compare,
        disturb,
        draw,
        explain,
        falsify,
        fit,
        load,
        optimise,
        plot,
        rare,
        run,
        save,
        study,
        view,
    )

    __version__: str

__all__ = [
    "Calibrated",
    "Comparison",
    "Disturbed",
    "EpicycleError",
    "Explained",
    "Falsified",
    "Fit",
    "Model",
    "ModelError",
    "Optimised",
    "Page",
    "Picture",
    "RareEvent",
    "Results",
    "Simulation",
    "StudyResults",
    "calibrate",
    "compare",
    "disturb",
    "draw",
    "explain",
    "falsify",
    "fit",
    "gym",
    "load",
    "open_study",
    "optimise",
    "plot",
    "rare",
    "run",
    "save",
    "study",
    "view",
    "zoo",
]

# Where to find each name on first use: `import epicycle` must not wait for NumPy and networkx. A new call needs a line
# here and above.
_HOMES = {
    "EpicycleError": "actors",
    **dict.fromkeys(("gym", "zoo"), "bridges"),
    **dict.fromkeys(("Model", "ModelError", "Results", "Simulation", "StudyResults", "open_study"), "runner"),
    **dict.fromkeys(
        (
            "Calibrated",
            "Comparison",
            "Disturbed",
            "Explained",
            "Falsified",
            "Optimised",
            "Fit",
            "Page",
            "Picture",
            "calibrate",
            "RareEvent",
            "compare",
            "disturb",
            "draw",
            "explain",
            "falsify",
            "fit",
            "load",
            "optimise",
            "plot",
            "rare",
            "run",
            "save",
            "study",
            "view",
        ),
        "runner.calls",
    ),
}
_FOLDERS = ("actors", "aspects", "bridges", "runner")


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    if name in _FOLDERS:  # `epicycle.actors.Clock` without a separate import
        return import_module(f"{__name__}.{name}")
    if name == "__version__":
        return import_module(f"{__name__}.runner.provenance").version_of("epicycle")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, *_FOLDERS})
