"""Searches over runs: one that breaks a property, and the smallest set of acts that breaks it there."""

from .explaining import Effect, Explanation, Step, explain
from .falsifying import AD_HOC, MAX_RUNS, Asked, Findings, Run, falsify
from .minimal import minimal
from .space import Interval
from .tried import Tried

__all__ = [
    "AD_HOC",
    "MAX_RUNS",
    "Asked",
    "Effect",
    "Explanation",
    "Findings",
    "Interval",
    "Run",
    "Step",
    "Tried",
    "explain",
    "falsify",
    "minimal",
]
