"""Heaps: of numbers, and of values with the tags that they wait for.

Compiled (``order.pyx``) if a compiler was available.
"""

from __future__ import annotations

from heapq import heappop, heappush
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .tag import Wake

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


class TimedQueue:
    """Values that wait for tags, or for wake-ups, in the order of these, and in the order of entry for the same tag."""

    __slots__ = ("content", "number")

    def __init__(self) -> None:
        # The number keeps the order of entry among equals, and values are never compared.
        self.content: list[tuple[int, int, int, Wake | None, Any]] = []
        self.number = 0

    def __len__(self) -> int:
        return len(self.content)

    @property
    def size(self) -> int:
        """The number of entries."""
        return len(self.content)

    def first(self) -> int:
        """The time of the first; ``NEVER`` if there is none."""
        return self.content[0][0] if self.content else NEVER

    def put(self, time: int, microstep: int, wake: Wake | None, value: Any) -> None:
        """Add an entry."""
        heappush(self.content, (time, microstep, self.number, wake, value))
        self.number += 1

    def push(self, wake: Wake, value: Any) -> None:
        """Add an entry that waits for a wake-up."""
        self.put(wake.time, wake.microstep, wake, value)

    def is_due(self) -> bool:
        """Whether the wake-up of the first is due."""
        return bool(self.content) and (wake := self.content[0][3]) is not None and wake.due

    def pop(self) -> Any:
        """Remove the first one."""
        return heappop(self.content)[4]

    def due(self) -> list[Any]:
        """Remove those whose wake-ups are due; gives them in their order."""
        values = []
        while self.is_due():
            values.append(self.pop())
        return values
