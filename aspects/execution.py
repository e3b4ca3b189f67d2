"""Execution aspects: they stand at actors, and decide when, or whether, these fire.

What passes the join point of an actor is a ``Job``: a firing that is due, with the tokens that came at its tag and the
wake-ups that the actor asked for.  ``point.forward(job)`` lets the actor fire; with a delay, or called later, it fires
then.  It finds the job's tokens in its ports and its wake-ups due, and all else as it is by that time: ``now`` is the
time at which it fires, and what it sends leaves then.  A job that is never forwarded is a firing that never happens.

Tokens that come, and wake-ups that fall due, while a job waits are jobs of their own.  An aspect keeps the jobs of one
actor in their order.  Where several aspects stand at one actor, the first declared is the first to get a job.

An aspect that is aimed at a composite stands at all the actors in it; ``point.unit`` is that composite.  Actors that
are processes (``run``) are fired by their waits and reads; where they wait for an event of SimPy's (a resource, a
timeout), no firing resumes them, and so no aspect can hold that up.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

from epicycle.actors import Actor, InputPort, Tag, Wake

from .core import Aspect, JoinPoint


@dataclass(eq=False)
class Job:
    """A firing that is due.

    ``released`` is the tag at which it fell due, in the time of the model.  ``arrivals`` are its tokens and their
    channels, ``wakes`` its wake-ups; the engine puts both back before the actor fires, at the ``rank`` at which it
    would have fired.  ``watch``, if set, is told how long the firing took to compute (s).
    """

    actor: Actor
    rank: int
    released: Tag
    arrivals: dict[InputPort[Any], tuple[list[Any], list[int]]]
    wakes: tuple[Wake, ...] = ()
    watch: Callable[[float], None] | None = None

    @property
    def tokens(self) -> dict[str, tuple[Any, ...]]:
        """The tokens that came, by the names of the ports; none once the actor has fired."""
        return {port.name: tuple(tokens) for port, (tokens, _) in self.arrivals.items()}

    @property
    def is_wanted(self) -> bool:
        """Whether there still is something to fire for: the actor may have cancelled the wake-ups meanwhile."""
        return bool(self.arrivals) or not all(wake.cancelled for wake in self.wakes)


class ActorPoint(JoinPoint):
    """An actor that an aspect stands at; ``unit`` is the path that was aimed at, the actor's or a composite's."""

    unit = ""

    @property
    def owner(self) -> str:
        """The path of the actor."""
        return self.port


class ExecutionAspect(Aspect, ABC):
    """An aspect of an actor's firing: write ``schedule``.

    ``is_processor``: it stands for the one processor that an actor has, so no two of this kind fit on an actor.
    """

    stands_at: ClassVar[frozenset[str]] = frozenset({"actor"})
    is_processor: ClassVar[bool] = False

    @abstractmethod
    def schedule(self, job: Job, point: ActorPoint) -> None:
        """Decide when, or whether, a job is executed: ``point.forward(job)``, now or later or never."""

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        assert isinstance(point, ActorPoint)
        self.schedule(token, point)
