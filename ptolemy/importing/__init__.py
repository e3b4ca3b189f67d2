"""Ptolemy II import: converts MoML files to models in YAML."""

from .document import MomlError
from .imported import Imported, import_moml

__all__ = ["Imported", "MomlError", "import_moml"]
