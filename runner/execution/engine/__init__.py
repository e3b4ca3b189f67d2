"""From a model to its results: director, event log, simulation."""

from ..results import (
    EventLog,
    LogError,
    LogFile,
    Record,
    Results,
    Signal,
    SignalError,
    canonical,
    cell,
    check_log_path,
    leaves,
    plain,
    write_log,
)
from .agenda import Activation, Delivery, Instant
from .copies import CopyError
from .director import Director, Entry
from .directors import Directors
from .errors import ActorError, LoopError
from .interventions import Interventions
from .local_time import BoundaryPort, LocalDirector
from .log_filter import LogFilter
from .pace import SLOWEST, Pace
from .receivers import Call
from .refinement import ModeDirector, Outer, Refinement
from .simulation import Simulation, Snapshot, SnapshotError
from .trace import Arrival, Firing, Tracer

__all__ = [
    "SLOWEST", "Activation", "ActorError", "Arrival", "BoundaryPort", "Call", "CopyError", "Delivery", "Director",
    "Directors", "Entry", "EventLog", "Firing", "Instant", "Interventions", "LocalDirector", "LogError", "LogFile",
    "LogFilter", "LoopError", "ModeDirector", "Outer", "Pace", "Record", "Refinement", "Results", "Signal",
    "SignalError", "Simulation", "Snapshot", "SnapshotError", "Tracer", "canonical", "cell", "check_log_path", "leaves",
    "plain", "write_log",
]  # fmt: skip
