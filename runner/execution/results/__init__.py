"""The results of a run: the event log and its digest, signals, metrics, and the files that hold them."""

from .arrow import write_signals
from .encoding import TokenError, canonical, cell, leaves, plain
from .log import EventLog, LogError, Record
from .log_file import LogFile, check_log_path, write_log
from .outcome import Interval, Outcome
from .record import Names, Past, Samples, Writer
from .results import STOP_TIME, Results
from .signal import Signal, SignalError
from .verdict import Verdict

__all__ = [
    "STOP_TIME", "EventLog", "Interval", "LogError", "LogFile", "Names", "Outcome", "Past", "Record", "Results",
    "Samples", "Signal", "SignalError", "TokenError", "Verdict", "Writer", "canonical", "cell", "check_log_path",
    "leaves", "plain", "write_log", "write_signals",
]  # fmt: skip
