"""From declarations, or a program, to a checked model."""

from .clock import Clock
from .composite_class import CompositeClass, load_composite
from .culprit import describe, raised_at
from .ends import CompositePort, Instance
from .figures import Complaint, figures_of, made_figure, place_in_figure, tell_of_figure
from .graph import Hop, ModelGraph, Wire, is_within
from .load import load_model
from .model import Model
from .schedule import firing_order
from .scope import Composite
from .watch import Metric
from .woven import WovenAspect, extent

__all__ = [
    "Clock",
    "Complaint",
    "Composite",
    "CompositeClass",
    "CompositePort",
    "Hop",
    "Instance",
    "Metric",
    "Model",
    "ModelGraph",
    "Wire",
    "WovenAspect",
    "describe",
    "extent",
    "figures_of",
    "firing_order",
    "is_within",
    "load_composite",
    "load_model",
    "made_figure",
    "place_in_figure",
    "raised_at",
    "tell_of_figure",
]
