"""Heaps: of numbers, and of values with the tags that they wait for.

Compiled (``order.pyx``) if a compiler was available.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from heapq import heappop, heappush
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .tag import Wake

NEVER = 2**63 - 1  # ns


class ReadyQueue:
    """Whole numbers from 0, the smallest first."""

    __slots__ = ("content", "push")

    def __init__(self) -> None:
        self.content: list[int] = []
        self.push: Callable[[int], None] = partial(heappush, self.content)  # add an entry

    def pop(self) -> int:
        """Remove the smallest one; -1 if there is none."""
        return heappop(self.content) if self.content else -1


class TimedQueue:
    """Values that wait for tags, or for wake-ups, in the order of these, and in the order of entry for the same tag."""

    __slots__ = ("content", "number")

    def __init__(self) -> None:
        # The number keeps the order of entry among equals, and values are never compared.
        self.content: list[tuple[int, int, int, Wake | None, Any]] = []
        self.number = 0

    def __len__(self) -> int:
        return len(self.content)

    def first(self) -> int:
        """The time of the first; ``NEVER`` if there is none."""
        return self.content[0][0] if self.content else NEVER

    def put(self, time: int, microstep: int, wake: Wake | None, value: Any) -> int:
        """Add an entry; returns how many there are."""
        heappush(self.content, (time, microstep, self.number, wake, value))
        self.number += 1
        return len(self.content)

    def push(self, wake: Wake, value: Any) -> None:
        """Add an entry that waits for a wake-up."""
        heappush(self.content, (wake.time, wake.microstep, self.number, wake, value))
        self.number += 1

    def is_due(self) -> bool:
        """Whether the wake-up of the first is due."""
        return bool(self.content) and (wake := self.content[0][3]) is not None and wake.due

    def pop(self) -> Any:
        """Remove the first one."""
        return heappop(self.content)[4]

    def due(self) -> list[Any]:
        """Remove those whose wake-ups are due; gives them in their order."""
        content, values = self.content, []
        while content and (wake := content[0][3]) is not None and wake.due:
            values.append(heappop(content)[4])
        return values
