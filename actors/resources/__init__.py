"""Resources and those that wait for them: pools, waiting lines, stations."""

from .line import WaitingLine
from .pool import Pool
from .stations import Machine, Station

__all__ = ["Machine", "Pool", "Station", "WaitingLine"]
