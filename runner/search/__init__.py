"""Searches over runs: the smallest set of acts that breaks a property."""

from .explaining import Effect, Explanation, Step, explain
from .minimal import minimal
from .tried import Tried

__all__ = ["Effect", "Explanation", "Step", "Tried", "explain", "minimal"]
