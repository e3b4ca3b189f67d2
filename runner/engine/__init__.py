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
from .acts import Acts
from .copies import CopyError
from .director import Director
from .errors import ActorError, LoopError
from .log_filter import LogFilter
from .pace import SLOWEST, Pace
from .simulation import Simulation, Snapshot, SnapshotError
from .trace import Arrival, Firing, Tracer

__all__ = [
    "SLOWEST",
    "ActorError",
    "Acts",
    "Arrival",
    "CopyError",
    "Director",
    "EventLog",
    "Firing",
    "LogError",
    "LogFile",
    "LogFilter",
    "LoopError",
    "Pace",
    "Record",
    "Results",
    "Signal",
    "SignalError",
    "Simulation",
    "Snapshot",
    "SnapshotError",
    "Tracer",
    "canonical",
    "cell",
    "check_log_path",
    "leaves",
    "plain",
    "write_log",
]
