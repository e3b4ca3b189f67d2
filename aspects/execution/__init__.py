"""Disturbances of execution: firings that take time, or share a processor, or do not happen, and crashes."""

from ..core import ActorPoint, ExecutionAspect, Job, Unit
from .crash import CrashRestart
from .execution_time import ExecutionTime, SkipFiring
from .processor import Processor

__all__ = [
    "ActorPoint",
    "CrashRestart",
    "ExecutionAspect",
    "ExecutionTime",
    "Job",
    "Processor",
    "SkipFiring",
    "Unit",
]
