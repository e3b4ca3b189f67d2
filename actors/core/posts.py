"""Posts: ranks that are taken out in the order in which they were posted, as far as they are of one group."""

from __future__ import annotations

from heapq import heappop, heappush

Place = tuple[tuple[int, int], ...]  # of a rank: its group and what it is there, in each director from the outermost on


class Posts:
    """Ranks with groups.

    What comes in a group of several may be a rank, or a director with groups of its own: of these, too, the first is
    the one for which something was posted first, and it goes on until nothing is left in it.
    """

    __slots__ = ("_heap", "_number", "_numbers", "_open", "_waiting", "places")

    def __init__(self, places: tuple[Place, ...]) -> None:
        self.places = places
        self._heap: list[tuple[tuple[int, ...], int]] = []
        self._number = 0  # of what was posted last
        self._numbers: dict[int, int] = {}  # of what is in a group, that of its first post
        self._waiting: dict[int, int] = {}  # how much is left in a director
        self._open: list[int] = []  # the directors that what was taken out last is in

    def push(self, rank: int) -> None:
        """Post a rank."""
        self._number += 1
        *outer, (own, _) = self.places[rank]
        key: list[int] = []
        for group, director in outer:
            key += group, self._numbers.setdefault(director, self._number)
            self._waiting[director] = self._waiting.get(director, 0) + 1
        heappush(self._heap, ((*key, own, self._number), rank))

    def first(self) -> int:
        """The rank that is next; -1 if there is none."""
        return self._heap[0][1] if self._heap else -1

    def pop(self) -> int:
        """Take the next rank out."""
        rank = heappop(self._heap)[1]
        around = [director for _, director in self.places[rank][:-1]]
        self._leave(around)
        for director in around:
            self._waiting[director] -= 1
        self._open = around
        return rank

    def settle(self) -> None:
        """A tag begins: what was done at the one before is over."""
        self._leave([])
        self._open = []
        if not self._heap:
            self._number = 0

    def _leave(self, around: list[int]) -> None:
        """Directors in which nothing is left are posted anew the next time, but for those that are gone on with."""
        for director in self._open:
            if director not in around and not self._waiting[director]:
                del self._numbers[director], self._waiting[director]
