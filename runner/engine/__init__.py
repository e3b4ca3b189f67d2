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
from .agenda import Delivery, Instant, Turn
from .copies import CopyError
from .director import Director, Entry
from .directors import Directors
from .errors import ActorError, LoopError
from .local_time import LocalDirector, Passage
from .log_filter import LogFilter
from .pace import SLOWEST, Pace
from .refinement import Conductor, Refinement
from .simulation import Simulation, Snapshot, SnapshotError
from .trace import Arrival, Firing, Tracer
from .way import Call

__all__ = [
    "SLOWEST",
    "ActorError",
    "Acts",
    "Arrival",
    "Call",
    "Conductor",
    "CopyError",
    "Delivery",
    "Director",
    "Directors",
    "Entry",
    "EventLog",
    "Firing",
    "Instant",
    "LocalDirector",
    "LogError",
    "LogFile",
    "LogFilter",
    "LoopError",
    "Pace",
    "Passage",
    "Record",
    "Refinement",
    "Results",
    "Signal",
    "SignalError",
    "Simulation",
    "Snapshot",
    "SnapshotError",
    "Tracer",
    "Turn",
    "canonical",
    "cell",
    "check_log_path",
    "leaves",
    "plain",
    "write_log",
]
