"""Searches over runs: one that breaks a property, and the smallest set of acts that breaks it there."""

"""Searches over runs: the smallest set of acts that breaks a property, and how probable it is that one is broken."""

from .calibrating import Calibration, Fitted, Match, Task, calibrate
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
    "Calibration",
    "Effect",
    "Explanation",
    "Findings",
    "Fitted",
    "Goal",
    "Interval",
    "Match",
    "Optimum",
    "Outcome",
    "Run",
    "Step",
    "Task",
    "Tested",
    "Tried",
    "calibrate",
    "explain",
    "falsify",
    "minimal",
    "optimise",
]
from .splitting import RareEvent, rare

__all__ = ["Effect", "Explanation", "RareEvent", "Step", "Tried", "explain", "minimal", "rare"]
