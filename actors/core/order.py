"""Heaps: of numbers, of times with the work due at them, and of values with the wake-ups that they wait for.

Compiled (``order.pyx``) if a compiler was available.
"""

from __future__ import annotations

from heapq import heappop, heappush
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .moment import Moment, Wake

NEVER = 2**63 - 1  # ns


class ReadyQueue:
    """Whole numbers, the smallest first."""

    __slots__ = ("content",)

    def __init__(self) -> None:
        self.content: list[int] = []

    @property
    def size(self) -> int:
        """The number of entries."""
        return len(self.content)

    def push(self, rank: int) -> None:
        """Add an entry."""
        heappush(self.content, rank)

    def pop(self) -> int:
        """Remove the smallest one."""
        return heappop(self.content)


class Calendar:
    """The work due at the first microstep of future times."""

    __slots__ = ("_heap", "content")

    def __init__(self) -> None:
        self.content: dict[int, Moment] = {}
        self._heap: list[int] = []

    @property
    def size(self) -> int:
        """The number of entries."""
        return len(self.content)

    def first(self) -> int:
        """The earliest time; ``NEVER`` if there is none."""
        return self._heap[0] if self._heap else NEVER

    def at(self, time: int) -> Any:
        """The work due at a time, if any."""
        return self.content.get(time)

    def add(self, instant: Moment) -> None:
        """Add a new time."""
        heappush(self._heap, instant.time)
        self.content[instant.time] = instant

    def pop(self) -> Any:
        """Remove the earliest time."""
        return self.content.pop(heappop(self._heap))


class TimedQueue:
    """Values that wait for wake-ups, in the order of these, and in the order of entry for the same tag."""

    __slots__ = ("content", "number")

    def __init__(self) -> None:
        # The number keeps the order of entry among equals, and values are never compared.
        self.content: list[tuple[int, int, int, Wake, Any]] = []
        self.number = 0

    def __len__(self) -> int:
        return len(self.content)

    def push(self, wake: Wake, value: Any) -> None:
        """Add an entry."""
        heappush(self.content, (wake.time, wake.microstep, self.number, wake, value))
        self.number += 1

    def is_due(self) -> bool:
        """Whether the time of the first has come."""
        return bool(self.content) and self.content[0][3].due

    def pop(self) -> Any:
        """Remove the first one."""
        return heappop(self.content)[4]
