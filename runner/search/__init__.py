"""Searches over runs: one that breaks a property, what breaks it there, how probable that is, and what is best."""

from .calibrating import Calibration, Fitted, Match, Task, calibrate
from .explaining import INTERRUPT, RUNS, Effect, Explanation, Step, explain
from .falsifying import MAX_RUNS, Asked, Findings, Run, falsify
from .faults import FaultSpace
from .minimal import minimal
from .monitored import AD_HOC, monitor_named, monitors_named
from .optimising import MAX_POINTS, Goal, Optimum, Outcome, Tested, optimise
from .space import Interval
from .splitting import RareEvent, rare
from .tried import Tried

__all__ = [
    "AD_HOC",
    "INTERRUPT",
    "MAX_POINTS",
    "MAX_RUNS",
    "RUNS",
    "Asked",
    "Calibration",
    "Effect",
    "Explanation",
    "FaultSpace",
    "Findings",
    "Fitted",
    "Goal",
    "Interval",
    "Match",
    "Optimum",
    "Outcome",
    "RareEvent",
    "Run",
    "Step",
    "Task",
    "Tested",
    "Tried",
    "calibrate",
    "explain",
    "falsify",
    "minimal",
    "monitor_named",
    "monitors_named",
    "optimise",
    "rare",
]
