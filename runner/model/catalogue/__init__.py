"""What a model may name: types of actors, aspects and ports, kinds of metrics, and packaged files."""

from .dialect import Dialect
from .types import Catalogue, built_in, given_functions, given_programs, installed, types_of_file

# What dialects and actors of other packages need.
__all__ = ["Catalogue", "Dialect", "built_in", "given_functions", "given_programs", "installed", "types_of_file"]
