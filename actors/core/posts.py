"""Posts: ranks that are taken out in the order in which they were posted, within one group."""

from __future__ import annotations

from heapq import heappop, heappush

Place = tuple[tuple[int, int], ...]  # of a rank: its group and its number there, in each director from the outermost in


class Posts:
    """Ranks with groups.

    A member of a group may be a rank, or a director with its own groups.  The director that was posted first is also
    first, and continues until nothing is left in it.
    """

    __slots__ = ("_heap", "_number", "_numbers", "_open", "_waiting", "places")

    def __init__(self, places: tuple[Place, ...]) -> None:
        self.places = places
        self._heap: list[tuple[tuple[int, ...], int]] = []
        self._number = 0  # of the last post
        self._numbers: dict[int, int] = {}  # of the members of a group, the number of its first post
        self._waiting: dict[int, int] = {}  # how many are left in a director
        self._open: Place = ()  # where the last one taken out belongs

    def push(self, rank: int) -> None:
        """Post a rank."""
        self._number += 1
        place = self.places[rank]
        key: tuple[int, ...] = ()
        for group, director in place[:-1]:
            key += group, self._numbers.setdefault(director, self._number)
            self._waiting[director] = self._waiting.get(director, 0) + 1
        heappush(self._heap, ((*key, place[-1][0], self._number), rank))

    def first(self) -> int:
        """The next rank; -1 if there is none."""
        return self._heap[0][1] if self._heap else -1

    def pop(self) -> int:
        """Take the next rank out."""
        rank = heappop(self._heap)[1]
        around = self.places[rank][:-1]
        if around or self._open:
            self._leave(around)
            for _, director in around:
                self._waiting[director] -= 1
        return rank

    def settle(self) -> None:
        """Begin a tag: the work of the previous one is over."""
        self._leave(())
        if not self._heap:
            self._number = 0

    def _leave(self, around: Place) -> None:
        """Directors in which nothing is left must be posted again, except those that continue."""
        for place in self._open:
            director = place[1]
            if place not in around and not self._waiting[director]:
                del self._numbers[director], self._waiting[director]
        self._open = around
