"""The frozen model: actors, composites, ports and connections, aspects at their places, what is watched, and ranks."""

from .model_graph import ModelGraph
from .ranks import steps

__all__ = ["ModelGraph", "steps"]  # what directors of other packages need
