"""Posts: ranks that are taken out in the order in which they were posted, where only that order decides."""

from __future__ import annotations

from heapq import heappop, heappush
from weakref import WeakKeyDictionary

from epicycle.runner.catalogue import Dialect
from epicycle.runner.graph import ModelGraph, steps

Place = tuple[tuple[int, int], ...]  # of a rank: its group and its number there, in each director from the outermost in
Layout = tuple[tuple[Place, ...], frozenset[str]]
_known: WeakKeyDictionary[ModelGraph, Layout] = WeakKeyDictionary()


def is_posted(dialect: type[Dialect], kind: type) -> bool:
    """Whether a dialect asks for a kind of director."""
    wanted = dialect.director()
    return wanted is not None and issubclass(kind, wanted)


def layout(graph: ModelGraph, kind: type) -> Layout:
    """The place of each rank, and the actors under directors with posted ties: the same for all runs.

    In these directors, steps of equal level form a group.
    """
    if graph in _known:
        return _known[graph]
    posted = {path for path, dialect in graph.dialects.items() if is_posted(dialect, kind)}
    order = steps(graph)
    numbers = {director: number for number, director in enumerate(graph.clocks)}
    found: list[Place] = []

    def unfold(director: str, around: Place) -> None:
        group, before = 0, None
        for step in order[director]:
            group += step.level is None or step.level != before or director not in posted
            before = step.level
            if (inner := step.paths[0]) in order and inner != director:
                unfold(inner, (*around, (group, numbers[inner])))
            else:
                found.append((*around, (group, 0)))

    unfold("", ())
    actors = frozenset(path for path in graph.actors if graph.director_of(path) in posted)
    return _known.setdefault(graph, (tuple(found), actors))


class Posts:
    """Ranks with groups.

    A member of a group may be a rank, or a director with its own groups.  The director that was posted first is also
    first, and continues until nothing is left in it.
    """

    def __init__(self, places: tuple[Place, ...]) -> None:
        self._places = places
        self._heap: list[tuple[tuple[int, ...], int]] = []
        self._number = 0  # of the last post
        self._numbers: dict[int, int] = {}  # of the members of a group, the number of its first post
        self._waiting: dict[int, int] = {}  # how many are left in a director
        self._open: Place = ()  # where the last one taken out belongs

    def push(self, rank: int) -> None:
        """Post a rank."""
        self._number += 1
        place = self._places[rank]
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
        around = self._places[rank][:-1]
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
