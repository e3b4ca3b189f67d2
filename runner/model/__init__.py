"""From YAML text to a checked model: document, declarations, elaboration, graph."""

from ..catalogue import is_path, packaged_disturbances, packaged_models, packaged_studies
from ..text import (
    NORMAL,
    RAISE_IT,
    Limits,
    ModelError,
    PatternError,
    Position,
    Problem,
    Problems,
    did_you_mean,
    select,
    told_raised,
)
from .clock import Clock
from .composite_class import CompositeClass, load_composite
from .culprit import describe, raised_at
from .ends import CompositePort, Instance
from .graph import Hop, ModelGraph, Wire
from .load import load_model
from .model import Model
from .schedule import firing_order
from .scope import Composite
from .watch import Metric
from .woven import WovenAspect, extent

__all__ = [
    "NORMAL",
    "RAISE_IT",
    "Clock",
    "Composite",
    "CompositeClass",
    "CompositePort",
    "Hop",
    "Instance",
    "Limits",
    "Metric",
    "Model",
    "ModelError",
    "ModelGraph",
    "PatternError",
    "Position",
    "Problem",
    "Problems",
    "Wire",
    "WovenAspect",
    "describe",
    "did_you_mean",
    "extent",
    "firing_order",
    "is_path",
    "load_composite",
    "load_model",
    "packaged_disturbances",
    "packaged_models",
    "packaged_studies",
    "raised_at",
    "select",
    "told_raised",
]
