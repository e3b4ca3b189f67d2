"""From YAML text to a checked model: document, declarations, elaboration, graph."""

from .graph import Hop, ModelGraph, Wire
from .load import load_model, packaged_models
from .model import Metric, Model
from .problems import ModelError, Position, Problem, Problems, did_you_mean
from .weave import WovenAspect

__all__ = [
    "Hop",
    "Metric",
    "Model",
    "ModelError",
    "ModelGraph",
    "Position",
    "Problem",
    "Problems",
    "Wire",
    "WovenAspect",
    "did_you_mean",
    "load_model",
    "packaged_models",
]
