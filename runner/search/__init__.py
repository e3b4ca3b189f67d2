"""Searches over runs: one that breaks a property, and the smallest set of acts that breaks it there."""

from .explaining import Effect, Explanation, Step, explain
from .falsifying import AD_HOC, MAX_RUNS, Asked, Findings, Run, falsify
from .minimal import minimal
from .optimising import MAX_POINTS, Goal, Optimum, Outcome, Tested, optimise
from .space import Interval
from .tried import Tried

__all__ = [
    "AD_HOC",
    "MAX_POINTS",
    "MAX_RUNS",
    "Asked",
    "Effect",
    "Explanation",
    "Findings",
    "Goal",
    "Interval",
    "Optimum",
    "Outcome",
    "Run",
    "Step",
    "Tested",
    "Tried",
    "explain",
    "falsify",
    "minimal",
    "optimise",
]
