"""From declarations, or a program, to a checked and frozen model."""

from .composite_class import CompositeClass, load_composite
from .disturbance import disturb_ports
from .figures import figures_of, made_figure, tell_of_figure
from .load import load_model
from .model import Model
from .named import CompositePort
from .scope import Composite

__all__ = [
    "Composite",
    "CompositeClass",
    "CompositePort",
    "Model",
    "disturb_ports",
    "figures_of",
    "load_composite",
    "load_model",
    "made_figure",
    "tell_of_figure",
]
