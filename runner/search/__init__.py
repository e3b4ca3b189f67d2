"""Searches over runs: the smallest set of acts that breaks a property, and how probable it is that one is broken."""

from .explaining import Effect, Explanation, Step, explain
from .minimal import minimal
from .splitting import RareEvent, rare
from .tried import Tried

__all__ = ["Effect", "Explanation", "RareEvent", "Step", "Tried", "explain", "minimal", "rare"]
