"""From YAML to results: models, simulations, pictures."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .execution.engine import ActorError, Simulation
    from .execution.results import Results, Signal
    from .execution.trial import Trial
    from .model.build.composite_class import load_composite
    from .model.build.load import load_model
    from .model.build.model import Model
    from .model.build.scope import Composite
    from .model.text.problems import ModelError
    from .study.judge.study_results import StudyResults, open_study

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
    "ActorError": "execution.engine",
    "Composite": "model.build.scope",
    "Results": "execution.results",
    "Signal": "execution.results",
    "Simulation": "execution.engine",
    "Trial": "execution.trial",
    "Model": "model.build.model",
    "ModelError": "model.text.problems",
    "load_composite": "model.build.composite_class",
    "load_model": "model.build.load",
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
