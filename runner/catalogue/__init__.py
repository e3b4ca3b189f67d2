"""What a model may name: types of actors, aspects and ports, kinds of metrics, and packaged files."""

from .dialect import Dialect
from .types import Catalogue, built_in, given_functions, installed

__all__ = ["Catalogue", "Dialect", "built_in", "given_functions", "installed"]  # what dialects of other packages need
