"""The kinds of aspects: of tokens at ports, of firings of actors, and aspects that are models themselves.

A ``Job`` passes the join point of an actor: a firing that is due, with the tokens that came at its tag and the wake-ups
that the actor requested.  ``point.forward(job)`` lets the actor fire; with a delay, or called later, it fires then.  It
finds the job's tokens in its ports and its wake-ups due, and everything else in its present state: ``now`` is the time
at which it fires, and its tokens are sent then.  If a job is never forwarded, the firing never happens.

Tokens that come, and wake-ups that fall due, while a job waits, are separate jobs.  An aspect keeps the jobs of one
actor in order.  If several aspects are attached to one actor, the first declared is the first to get a job.

An aspect aimed at a composite attaches to all the actors in it, with one ``point.target`` for all of them: whatever
concerns the composite as a whole, such as a crash, has its stream, memory and events there.  Actors that are processes
(``run``) are fired by their waits and reads; if they wait for an event of SimPy (a resource, a timeout), no firing
resumes them, so no aspect can delay that.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Protocol

from epicycle.actors import Actor, InputPort, Parameter, Tag, Wake

from .join_point import JoinPoint, JoinPointAspect, Memory, aspect_stream


class PortAspect(JoinPointAspect[Any, JoinPoint]):
    """An aspect of the tokens that pass ports: write ``pass_token``.

    ``stands_at`` says which ports: "input" (communication), "output" (measurement), or both.  ``alters_parameters``: it
    may also attach to numeric parameters, which it gets as tokens whenever their actors fire.
    """

    at_ports: ClassVar[bool] = True
    stands_at: ClassVar[frozenset[str]] = frozenset({"input", "output"})

    @abstractmethod
    def pass_token(self, token: Any, point: JoinPoint) -> None:
        """Decide what happens to a token at a join point."""


class CommunicationAspect(PortAspect):
    """An aspect of the communication to an input port."""

    stands_at: ClassVar[frozenset[str]] = frozenset({"input"})


class MeasurementAspect(PortAspect):
    """An aspect of the tokens that leave an output port."""

    stands_at: ClassVar[frozenset[str]] = frozenset({"output"})


class ObservationAspect(PortAspect):
    """An aspect that observes tokens and never changes them: write ``observe``.

    Every token continues at once, whatever ``observe`` does.
    """

    @abstractmethod
    def observe(self, token: Any, point: JoinPoint) -> None:
        """Observe a token before it continues."""

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        self.observe(token, point)
        point.forward(token)


class LossAspect(PortAspect):
    """An aspect that loses some tokens: write ``loses``.  A loss is noted as the first of its ``events``."""

    events: ClassVar[tuple[str, ...]] = ("dropped",)

    @abstractmethod
    def loses(self, token: Any, point: JoinPoint) -> bool:
        """Whether a token is lost."""

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        if self.loses(token, point):
            point.act(self.events[0], token)
        else:
            point.forward(token)


class RandomLoss(LossAspect):
    """A loss that does not depend on the token: write ``draw``."""

    spare_first = Parameter(bool, False, doc="whether tokens always pass at the first tag at which any come")

    @abstractmethod
    def draw(self, point: JoinPoint) -> bool:
        """Whether the next token is lost; the number of random draws must not depend on the strength."""

    def loses(self, token: Any, point: JoinPoint) -> bool:
        lost = self.draw(point)
        if self.spare_first and (lost or "first tag" not in point.memory):
            return point.tag != point.memory.setdefault("first tag", point.tag) and lost
        return lost


def is_bad(point: JoinPoint, worsens: float, recovers: float) -> bool:
    """The state of a two-state Markov chain with one step per token; it starts in its stationary distribution.

    ``worsens`` is the probability of a step good -> bad, ``recovers`` that of bad -> good.  One uniform number is drawn
    for every token.
    """
    draw = point.random.random()
    bad = point.memory.get("bad")
    if bad is None:
        bad = draw * (worsens + recovers) < worsens
    else:
        bad = draw >= recovers if bad else draw < worsens
    point.memory["bad"] = bad
    return bool(bad)


@dataclass(eq=False)
class Job:
    """A firing that is due.

    ``released`` is the tag at which it fell due, in the time of the model.  ``arrivals`` are its tokens and their
    channels, ``wakes`` its wake-ups; the engine restores both before the actor fires, at its original ``rank``.
    ``watch``, if set, is called with the computing time of the firing (s).
    """

    actor: Actor
    rank: int
    released: Tag
    arrivals: dict[InputPort[Any], tuple[list[Any], list[int]]]
    wakes: tuple[Wake, ...] = ()
    watch: Callable[[float], None] | None = None
    life: int = 0  # number of crashes of the actor before it; a later crash cancels the job

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
        """Whether there is still a reason to fire: the actor may have cancelled the wake-ups meanwhile."""
        return bool(self.arrivals) or not all(wake.cancelled for wake in self.wakes)


class Keeper(Protocol):
    """The control of the engine over an actor as a whole."""

    def suspend(self, point: ActorPoint, keeps: Callable[[Job, ActorPoint], bool]) -> None:
        """Suspend the actor until ``resume``; ``keeps`` says whether a job that falls due meanwhile waits."""

    def resume(self, point: ActorPoint) -> None:
        """Let the actor fire again: first the jobs forwarded meanwhile, then those that fell due."""

    def kill(self) -> None:
        """Cancel the actor's wake-ups and drop its jobs; its state no longer counts."""

    def restart(self) -> None:
        """Restart the actor."""


class ActorPoint(JoinPoint):
    """An actor to which an aspect is attached; ``target`` is its target, this actor or a composite around it."""

    target: Target
    keeper: Keeper


_WHOLE = " as a whole"  # a part of the name of a random stream: with another one, results would change


class Target(ActorPoint):
    """The target of an execution aspect as a whole: the ``points`` of its actors."""

    def __init__(self, path: str, first: ActorPoint) -> None:
        place = replace(first.place, port=path, source=path, key=path)
        super().__init__(place, Memory(first.shared), first._context)
        self.random = aspect_stream(first._context.streams, path, first.aspect + _WHOLE)
        self.points: list[ActorPoint] = []

    def suspend(self, keeps: Callable[[Job, ActorPoint], bool]) -> None:
        """Suspend its actors.  Forwarded jobs wait; a job that falls due also waits, before any aspect gets it, if
        ``keeps`` says so.
        """
        for point in self.points:
            point.keeper.suspend(point, keeps)

    def resume(self) -> None:
        """Let its actors fire again, first for the jobs that wait."""
        for point in self.points:
            point.keeper.resume(point)

    def kill(self) -> None:
        """Discard the state, the wake-ups and the unfinished work of its actors."""
        for point in self.points:
            point.keeper.kill()

    def restart(self) -> None:
        """Restart its actors, in the order of their declaration."""
        for point in self.points:
            point.keeper.restart()


class ExecutionAspect(JoinPointAspect[Job, ActorPoint]):
    """An aspect of an actor's firing: write ``schedule``.

    ``is_processor``: it represents the processor of the actor, so an actor can have only one such aspect.
    """

    is_processor: ClassVar[bool] = False

    def begin(self, target: Target) -> None:
        """Called once before the first tag for each target, for actions that it starts itself."""

    @abstractmethod
    def schedule(self, job: Job, point: ActorPoint) -> None:
        """Decide when, or whether, a job is executed: ``point.forward(job)``, now or later or never."""


@dataclass(frozen=True)
class Request:
    """A token on its way through an aspect that is a model; the actors of such a composite receive and send requests.

    ``source`` is the port that the token comes from, ``port`` its destination (the connection, for an aspect on a
    single one), ``time`` when it came, in s.  The answer of the composite continues where the request came from: an
    actor inside may keep a request for a while, lose it, or change its token with ``dataclasses.replace(request,
    token=...)``.
    """

    token: Any
    source: str
    port: str
    time: float
    aspect: str
    way: int = 0  # number of the route through the port


@dataclass(frozen=True)
class FiringRequest(Request):
    """A firing that is due, on its way through an aspect that is a model: ``port`` is the path of the actor.

    ``execution_time`` (s) is that of this actor in the aspect; ``token`` is None.  The actor fires when the request is
    answered, with the tokens and wake-ups of the time at which it came.
    """

    execution_time: float = 0.0


class CompositeAspect(PortAspect):
    """An aspect that is a model: each token is a request to a composite, and continues when the composite answers.

    Events: ``requested``; ``delivered``, with the seconds since.  A token whose request is never answered is lost.
    Ptolemy: ``CompositeCommunicationAspect``.
    """

    events: ClassVar[tuple[str, ...]] = ("requested", "delivered")

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        point.enter(token)


class CompositeExecutionAspect(ExecutionAspect):
    """An aspect at actors that is a model: each firing is a request to a composite, and happens when it answers.

    Events: ``requested``, with the execution time; ``executed``, with the seconds since.  A firing whose request is
    never answered never happens.  Ptolemy: ``CompositeExecutionAspect``.
    """

    events: ClassVar[tuple[str, ...]] = ("requested", "executed")
    is_processor: ClassVar[bool] = True

    def schedule(self, job: Job, point: ActorPoint) -> None:
        point.enter(job)
