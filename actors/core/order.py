"""Heaps: numbers, times and what is to be done at them, values and the wake-ups that they wait for.

Compiled, where a compiler was there (``order.pyx``).
"""

from __future__ import annotations

from heapq import heappop, heappush
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .moment import Wake, When
    from .posts import Posts

NEVER = 2**63 - 1  # ns


class Ranks:
    """Whole numbers, of which the least comes first; with ``posts``, the one that comes first there."""

    __slots__ = ("content", "posts")

    def __init__(self) -> None:
        self.content: list[int] = []
        self.posts: Posts | None = None

    @property
    def size(self) -> int:
        """How many there are."""
        return len(self.content)

    def push(self, rank: int) -> None:
        """Put one in."""
        if self.posts is not None:
            self.posts.push(rank)
            self.content.append(rank)  # so many there are; which, the posts know
        else:
            heappush(self.content, rank)

    def pop(self) -> int:
        """Take the least one out."""
        if self.posts is not None:
            self.content.pop()
            return self.posts.pop()
        return heappop(self.content)


class Times:
    """What is to be done at the first microstep of times to come."""

    __slots__ = ("_heap", "content")

    def __init__(self) -> None:
        self.content: dict[int, When] = {}
        self._heap: list[int] = []

    @property
    def size(self) -> int:
        """How many there are."""
        return len(self.content)

    def first(self) -> int:
        """The earliest time; ``NEVER`` if there is none."""
        return self._heap[0] if self._heap else NEVER

    def at(self, time: int) -> Any:
        """What is to be done at a time, if there is something."""
        return self.content.get(time)

    def add(self, instant: When) -> None:
        """Put in a time that was not there."""
        heappush(self._heap, instant.time)
        self.content[instant.time] = instant

    def pop(self) -> Any:
        """Take the earliest out."""
        return self.content.pop(heappop(self._heap))


class Line:
    """Values that wait for wake-ups, in the order of these, and of their entry where they are for the same tag."""

    __slots__ = ("content", "number")

    def __init__(self) -> None:
        # The number keeps the order of entry among equals, and values are never compared.
        self.content: list[tuple[int, int, int, Wake, Any]] = []
        self.number = 0

    def __len__(self) -> int:
        return len(self.content)

    def push(self, wake: Wake, value: Any) -> None:
        """Put one in."""
        heappush(self.content, (wake.time, wake.microstep, self.number, wake, value))
        self.number += 1

    def is_due(self) -> bool:
        """Whether the time of the first has come."""
        return bool(self.content) and self.content[0][3].due

    def pop(self) -> Any:
        """Take the first out."""
        return heappop(self.content)[4]
