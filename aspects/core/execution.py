"""Execution aspects: they stand at actors, and decide when, or whether, these fire.

What passes the join point of an actor is a ``Job``: a firing that is due, with the tokens that came at its tag and the
wake-ups that the actor asked for.  ``point.forward(job)`` lets the actor fire; with a delay, or called later, it fires
then.  It finds the job's tokens in its ports and its wake-ups due, and all else as it is by that time: ``now`` is the
time at which it fires, and what it sends leaves then.  A job that is never forwarded is a firing that never happens.

Tokens that come, and wake-ups that fall due, while a job waits are jobs of their own.  An aspect keeps the jobs of one
actor in their order.  Where several aspects stand at one actor, the first declared is the first to get a job.

An aspect that is aimed at a composite stands at all the actors in it, and ``point.unit`` is one for all of them: what
concerns the composite as a whole, such as a crash, has its stream, memory and events there.  Actors that are
processes (``run``) are fired by their waits and reads; where they wait for an event of SimPy's (a resource, a
timeout), no firing resumes them, and so no aspect can hold that up.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

from epicycle.actors import Actor, InputPort, Tag, Wake

from .join_point import JoinPoint, JoinPointAspect, aspect_stream


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
    life: int = 0  # how many crashes of the actor were before it; one that comes after it makes an end of it

    @property
    def tokens(self) -> dict[str, tuple[Any, ...]]:
        """The tokens that came, by the names of the ports; none once the actor has fired."""
        return {port.name: tuple(tokens) for port, (tokens, _) in self.arrivals.items()}

    @property
    def is_triggered(self) -> bool:
        """Whether there is work for the actor: a wake-up, or a token at a port that triggers it."""
        return bool(self.wakes) or any(port.triggers for port in self.arrivals)

    @property
    def is_wanted(self) -> bool:
        """Whether there still is something to fire for: the actor may have cancelled the wake-ups meanwhile."""
        return bool(self.arrivals) or not all(wake.cancelled for wake in self.wakes)


class Keeper(Protocol):
    """What the engine can do with an actor as a whole."""

    def suspend(self, point: ActorPoint, keeps: Callable[[Job, ActorPoint], bool]) -> None:
        """Let the actor not fire until ``resume``; ``keeps`` says whether a job that falls due meanwhile waits."""

    def resume(self, point: ActorPoint) -> None:
        """Let the actor fire again: first for what was forwarded meanwhile, then for what fell due."""

    def kill(self) -> None:
        """Cancel the actor's wake-ups and drop its jobs; its state no longer counts."""

    def restart(self) -> None:
        """Let the actor begin anew."""


class ActorPoint(JoinPoint):
    """An actor that an aspect stands at; ``unit`` is what was aimed at, this actor or a composite around it."""

    unit: Unit
    keeper: Keeper

    @staticmethod
    def _parts(port: str) -> tuple[str, str]:
        """The path of the actor."""
        return port, ""


class Unit(ActorPoint):
    """What an execution aspect was aimed at, as a whole: the ``points`` of the actors that it stands at for it."""

    def __init__(self, path: str, first: ActorPoint) -> None:
        super().__init__(first.aspect, path, first._context, lambda job: None, first.shared)
        self.random = aspect_stream(first._context.seed, path, f"{first.aspect} as a whole")
        self.points: list[ActorPoint] = []
        self._readings = first._readings

    def suspend(self, keeps: Callable[[Job, ActorPoint], bool]) -> None:
        """From now on its actors do not fire.  What is forwarded to them waits; so does a job that falls due, before
        any aspect gets it, if it ``keeps`` that job.
        """
        for point in self.points:
            point.keeper.suspend(point, keeps)

    def resume(self) -> None:
        """From now on its actors fire again, at first for the jobs that wait."""
        for point in self.points:
            point.keeper.resume(point)

    def kill(self) -> None:
        """Let its actors lose their state, their wake-ups and what they had begun."""
        for point in self.points:
            point.keeper.kill()

    def restart(self) -> None:
        """Let its actors begin anew, in the order of their declaration."""
        for point in self.points:
            point.keeper.restart()


class ExecutionAspect(JoinPointAspect[Job, ActorPoint]):
    """An aspect of an actor's firing: write ``schedule``.

    ``is_processor``: it stands for the one processor that an actor has, so no two of this kind fit on an actor.
    """

    is_processor: ClassVar[bool] = False

    def begin(self, unit: Unit) -> None:
        """Called once before the first tag for all that it was aimed at: for what it does of its own accord."""

    @abstractmethod
    def schedule(self, job: Job, point: ActorPoint) -> None:
        """Decide when, or whether, a job is executed: ``point.forward(job)``, now or later or never."""
