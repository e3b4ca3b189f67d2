"""From YAML to results: models, simulations, pictures."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .build.composite_class import load_composite
    from .build.load import load_model
    from .build.model import Model
    from .build.scope import Composite
    from .engine import ActorError, Simulation
    from .results import Results, Signal
    from .study.judge.study_results import StudyResults, open_study
    from .text.problems import ModelError
    from .trial import Trial

__all__ = [
    "ActorError",
    "Composite",
    "Model",
    "ModelError",
    "Results",
    "Signal",
    "Simulation",
    "StudyResults",
    "Trial",
    "load_composite",
    "load_model",
    "open_study",
]

_HOMES = {
    "ActorError": "engine",
    "Composite": "build.scope",
    "Results": "results",
    "Signal": "results",
    "Simulation": "engine",
    "Trial": "trial",
    "Model": "build.model",
    "ModelError": "text.problems",
    "load_composite": "build.composite_class",
    "load_model": "build.load",
    "StudyResults": "study.judge.study_results",
    "open_study": "study.judge.study_results",
}


def __getattr__(name: str) -> Any:
    # Loaded on first use: `epicycle --help` must not wait for NumPy and networkx.
    if name in _HOMES:
        return getattr(import_module(f".{_HOMES[name]}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
