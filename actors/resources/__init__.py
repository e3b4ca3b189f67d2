"""Resources and tokens that wait for them: pools, waiting lines, stations."""

from .line import WaitingLine
from .pool import Pool, Pools
from .stations import Machine, Station
from .waiting import Waiter, Waiters

__all__ = ["Machine", "Pool", "Pools", "Station", "Waiter", "Waiters", "WaitingLine"]
