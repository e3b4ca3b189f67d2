"""From a model to its results: director, event log, simulation."""

from .director import ActorError, Director, LoopError
from .encoding import canonical, plain, scalars
from .log import EventLog, LogError, Record, check_log_path, write_log
from .results import Results
from .signal import Signal, SignalError
from .simulation import Simulation

__all__ = [
    "ActorError",
    "Director",
    "EventLog",
    "LogError",
    "LoopError",
    "Record",
    "Results",
    "Signal",
    "SignalError",
    "Simulation",
    "canonical",
    "check_log_path",
    "plain",
    "scalars",
    "write_log",
]
