"""Ranks that are taken out as they were posted, against lists within lists."""

from __future__ import annotations

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from epicycle.ptolemy.posted import Place, Posts


class Queue:
    """What is posted under one director: its groups, in each of them ranks, and the queues of directors within."""

    def __init__(self) -> None:
        self.groups: dict[int, list[Any]] = {}
        self.within: dict[int, Queue] = {}

    def push(self, place: Place, rank: int) -> None:
        (group, director), *inner = place
        there = self.groups.setdefault(group, [])
        if not inner:
            there.append(rank)
            return
        queue = self.within.setdefault(director, Queue())
        if queue not in there:
            there.append(queue)
        queue.push(tuple(inner), rank)

    def pop(self) -> int | None:
        for group in sorted(self.groups):
            there = self.groups[group]
            while there:
                if isinstance(there[0], int):
                    return int(there.pop(0))
                if (found := there[0].pop()) is not None:
                    return int(found)
                del there[0]
        return None


PLACES: tuple[Place, ...] = (
    ((0, 0),),
    ((0, 0),),
    ((0, 1), (0, 0)),
    ((0, 1), (1, 0)),
    ((0, 1), (1, 0)),
    ((0, 2), (0, 3), (0, 0)),
    ((0, 2), (0, 3), (0, 0)),
    ((0, 2), (0, 0)),
    ((1, 4), (0, 0)),
    ((1, 4), (0, 0)),
    ((1, 0),),
    ((2, 0),),
)
STEPS = st.lists(st.one_of(st.integers(0, len(PLACES) - 1), st.none()), max_size=40)


@given(STEPS)
def test_as_lists_within_lists(steps: list[int | None]) -> None:
    """Push ranks, and take one out for each None; whatever is left in the end, too."""
    posts, queue = Posts(PLACES), Queue()
    for step in [*steps, *[None] * len(steps)]:
        if step is not None:
            posts.push(step)
            queue.push(PLACES[step], step)
        elif posts.first() >= 0:
            assert posts.first() == queue.pop() == posts.pop()
    assert posts.first() == -1
    assert queue.pop() is None


def test_a_tag_begins_anew() -> None:
    """A director that is done with is posted anew, also where nothing else came between."""
    posts = Posts(PLACES)
    posts.push(2)
    assert posts.pop() == 2
    posts.settle()
    posts.push(0)
    posts.push(2)
    assert [posts.pop(), posts.pop()] == [0, 2]
    posts.push(2)
    posts.push(0)
    posts.settle()  # what was posted before counts
    assert [posts.pop(), posts.pop()] == [2, 0]
