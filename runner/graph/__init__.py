"""The frozen model: actors, composites, ports and connections, aspects at their places, what is watched, and ranks."""

from .clock import Clock
from .model_graph import Detour, Hop, Modal, ModelGraph, Wire, is_within
from .ranks import dependencies, firing_order
from .watched import Metric, Watched
from .woven import AspectModel, WovenAspect, check_processors, extent

__all__ = [
    "AspectModel",
    "Clock",
    "Detour",
    "Hop",
    "Metric",
    "Modal",
    "ModelGraph",
    "Watched",
    "Wire",
    "WovenAspect",
    "check_processors",
    "dependencies",
    "extent",
    "firing_order",
    "is_within",
]
