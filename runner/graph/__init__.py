"""The frozen model: actors, composites, ports and connections, aspects at their places, what is watched, and ranks."""

from .acts import Act, ActName, connection_place
from .clock import Clock
from .digraph import find_loop, in_order
from .model_graph import Detour, Hop, Modal, ModelGraph, PortNode, Wire, is_within
from .ranks import Region, Step, dependencies, firing_order, steps
from .watched import Metric, Monitor, Part, Watched
from .woven import AspectModel, WovenAspect, check_processors, extent

__all__ = [
    "Act",
    "ActName",
    "AspectModel",
    "Clock",
    "Detour",
    "Hop",
    "Metric",
    "Modal",
    "ModelGraph",
    "Monitor",
    "Part",
    "PortNode",
    "Region",
    "Step",
    "Watched",
    "Wire",
    "WovenAspect",
    "check_processors",
    "connection_place",
    "dependencies",
    "extent",
    "find_loop",
    "firing_order",
    "in_order",
    "is_within",
    "steps",
]
