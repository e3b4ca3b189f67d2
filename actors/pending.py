"""Pending: what an actor has still to do, each thing with the wake-up that it waits for."""

from __future__ import annotations

import heapq
from itertools import count
from typing import Generic, TypeVar

from .core import Actor, Tag, Wake

T = TypeVar("T")


class Pending(Generic[T]):
    """Values that wait for their time: ``put`` them in ``fire``, and take those whose time has come with ``due``."""

    def __init__(self, actor: Actor) -> None:
        self._actor = actor
        # The number keeps the order of entry among equals, and values are never compared.
        self._heap: list[tuple[Tag, int, Wake, T]] = []
        self._number = count()

    def __len__(self) -> int:
        return len(self._heap)

    def put(self, value: T, delay: float) -> None:
        """Keep a value for ``delay`` seconds; 0 is the next microstep."""
        wake = self._actor.wake_in(delay)
        heapq.heappush(self._heap, (wake.tag, next(self._number), wake, value))

    def due(self) -> list[T]:
        """Take the values whose time is the present tag, in the order in which they were put."""
        values = []
        while self._heap and self._heap[0][2].due:
            values.append(heapq.heappop(self._heap)[3])
        return values
