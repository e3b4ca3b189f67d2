"""Models of Ptolemy II: MoML files as models in YAML."""

from .document import MomlError
from .imported import Imported, import_moml

__all__ = ["Imported", "MomlError", "import_moml"]
