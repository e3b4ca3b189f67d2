"""What a model may name: types of actors, aspects and ports, kinds of metrics, and packaged files."""

from .dialect import Dialect
from .types import Catalogue, built_in, installed

__all__ = ["Catalogue", "Dialect", "built_in", "installed"]  # what dialects of other packages need
