"""Positioned text: YAML as nodes with positions, problems with places, and limits; it does not know the language."""

from .limits import Limits

__all__ = ["Limits"]  # what directors of other packages need
