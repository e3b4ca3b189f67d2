"""From a model to its results: director, event log, simulation."""

from .director import ActorError, Director, LoopError
from .encoding import canonical, cell, leaves, plain
from .log import EventLog, LogError, Record
from .log_file import LogFile, check_log_path, write_log
from .log_filter import LogFilter
from .pace import SLOWEST, Pace
from .results import Results
from .signal import Signal, SignalError
from .simulation import Simulation
from .trace import Arrival, Firing, Tracer

__all__ = [
    "SLOWEST",
    "ActorError",
    "Arrival",
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
    "Tracer",
    "canonical",
    "cell",
    "check_log_path",
    "leaves",
    "plain",
    "write_log",
]
