"""The agenda: the turns that actors have in a tag, and what is to be done at the tags to come."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import simpy

from epicycle.actors import Actor, InputPort, Tag, Wake


class Turn:
    """The place of an actor in the firing order: where it fires for its wake-ups, or for the tokens of some inputs.

    ``ports`` are these inputs, ``later`` those whose tokens are taken in a later turn of the same actor; ports that
    nothing is connected to are left out.  ``wakes`` are the wake-ups of the present tag.
    """

    __slots__ = ("actor", "is_wanted", "later", "ports", "rank", "wakes")

    def __init__(self, actor: Actor, rank: int, ranks: Mapping[str, int]) -> None:
        self.actor = actor
        self.rank = rank
        connected = [port for port in actor.inputs.values() if port.width]
        self.ports: list[InputPort[Any]] = [port for port in connected if ranks[port.path] == rank]
        self.later: list[InputPort[Any]] = [port for port in connected if ranks[port.path] > rank]
        self.is_wanted = False  # whether the actor is to have this turn at the present tag
        self.wakes: list[Wake] = []

    def use_wakes(self) -> bool:
        """Make the wake-ups due; false if all were cancelled and there is nothing else to fire for."""
        due = False
        for wake in self.wakes:
            if not wake.cancelled:
                wake.due = due = True
        self.wakes.clear()
        return due or any(port.present for port in self.ports)


class Instant:
    """What is to be done at one tag: tokens to deliver, then wake-ups."""

    __slots__ = ("deliveries", "tag", "wakes")

    def __init__(self, tag: Tag) -> None:
        self.tag = tag
        self.deliveries: list[Callable[[], None]] = []
        self.wakes: list[tuple[Turn, Wake]] = []


class Environment(simpy.Environment):
    """SimPy's part of a run: time, and the events of processes and resources.

    The director's own instants are no SimPy events: it would make and handle one for each, for a tenth of the time of
    a run, only to be told what it knows.
    """

    def comes_by(self, time: float) -> bool:
        """Whether the next of SimPy's own events is at a time, or before."""
        return bool(self._queue) and self._queue[0][0] <= time

    def move_on(self, time: int) -> None:
        """It is later now; none of SimPy's events may be earlier."""
        self._now = time
