"""From YAML text to a checked model: document, declarations, elaboration, graph."""

from .clock import Clock
from .graph import Hop, ModelGraph, Wire
from .load import load_model, packaged_models
from .model import Metric, Model
from .problems import ModelError, Position, Problem, Problems, did_you_mean
from .schedule import firing_order
from .weave import WovenAspect

__all__ = [
    "Clock",
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
    "firing_order",
    "load_model",
    "packaged_models",
]
