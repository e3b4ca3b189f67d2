"""What a model may name: types of actors, aspects and ports, kinds of metrics, and packaged files."""

from .dialect import Dialect  # what a package of a dialect needs: the face is for the world outside

__all__ = ["Dialect"]
