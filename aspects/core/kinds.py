"""The kinds of aspects: those of what passes ports, those of firings of actors, and those that are models themselves.

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

from epicycle.actors import Actor, InputPort, Parameter, Tag, Wake

from .join_point import JoinPoint, JoinPointAspect, aspect_stream


class PortAspect(JoinPointAspect[Any, JoinPoint]):
    """An aspect of the tokens that pass ports: write ``pass_token``.

    ``stands_at`` says at which: "input" (communication), "output" (measurement), or both.  ``alters_parameters``: it
    may also stand at parameters that are numbers, which it gets as tokens whenever their actors fire.
    """

    at_ports: ClassVar[bool] = True
    stands_at: ClassVar[frozenset[str]] = frozenset({"input", "output"})

    @abstractmethod
    def pass_token(self, token: Any, point: JoinPoint) -> None:
        """Decide what becomes of a token at a join point."""


class CommunicationAspect(PortAspect):
    """An aspect of the way to an input port."""

    stands_at: ClassVar[frozenset[str]] = frozenset({"input"})


class MeasurementAspect(PortAspect):
    """An aspect of what leaves an output port."""

    stands_at: ClassVar[frozenset[str]] = frozenset({"output"})


class ObservationAspect(PortAspect):
    """An aspect that looks at what passes and never changes it: write ``observe``.

    Every token goes on at once, whatever ``observe`` does with what it sees.
    """

    @abstractmethod
    def observe(self, token: Any, point: JoinPoint) -> None:
        """Look at a token before it goes on."""

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        self.observe(token, point)
        point.forward(token)


class LossAspect(PortAspect):
    """An aspect that lets some tokens not pass: write ``loses``.  A loss is noted as the first of its ``events``."""

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

    spare_first = Parameter(bool, False, doc="tokens of the first tag at which any comes always pass")

    @abstractmethod
    def draw(self, point: JoinPoint) -> bool:
        """Whether the next token is lost; as many random numbers are drawn at any strength."""

    def loses(self, token: Any, point: JoinPoint) -> bool:
        lost = self.draw(point)
        if self.spare_first and (lost or "first tag" not in point.memory):
            return point.tag != point.memory.setdefault("first tag", point.tag) and lost
        return lost


def is_bad(point: JoinPoint, worsens: float, recovers: float) -> bool:
    """The state of a two-state Markov chain that takes one step for every token; it starts in its stationary law.

    ``worsens`` is the probability of good -> bad in a step, ``recovers`` that of bad -> good.  One uniform number is
    drawn for every token.
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
        """Let the actor begin again."""


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
        self.random = aspect_stream(first._context.streams, path, f"{first.aspect} as a whole")
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
        """Let its actors begin again, in the order of their declaration."""
        for point in self.points:
            point.keeper.restart()


class ExecutionAspect(JoinPointAspect[Job, ActorPoint]):
    """An aspect of an actor's firing: write ``schedule``.

    ``is_processor``: it stands for the one processor that an actor has, so no two of this kind fit on an actor.
    """

    is_processor: ClassVar[bool] = False

    def begin(self, unit: Unit) -> None:
        """Called once before the first tag for everything it was aimed at: for what it does on its own."""

    @abstractmethod
    def schedule(self, job: Job, point: ActorPoint) -> None:
        """Decide when, or whether, a job is executed: ``point.forward(job)``, now or later or never."""


@dataclass(frozen=True)
class Request:
    """A token on its way through an aspect that is a model: what the actors of such a composite get and send.

    ``source`` is the port that the token comes from, ``port`` where it was going (the connection, for an aspect that
    stands on one alone), ``time`` when it came, in s.  What the composite answers goes on to where the request came
    from: an actor inside may keep a request for a while, lose it, or change its token with
    ``dataclasses.replace(request, token=...)``.
    """

    token: Any
    source: str
    port: str
    time: float
    aspect: str
    way: int = 0  # which of the ways through the port


@dataclass(frozen=True)
class FiringRequest(Request):
    """A firing that is due, on its way through an aspect that is a model: ``port`` is the path of the actor.

    ``execution_time`` (s) is what the aspect says of this actor; ``token`` is None.  The actor fires when the request
    is answered, with the tokens and wake-ups of the time at which it came.
    """

    execution_time: float = 0.0


class CompositeAspect(PortAspect):
    """An aspect that is a model: each token is a request to a composite, and goes on when the composite answers.

    Events: ``requested``; ``delivered``, with the seconds since.  A request that is never answered is a token lost.
    Ptolemy: ``CompositeCommunicationAspect``.
    """

    events: ClassVar[tuple[str, ...]] = ("requested", "delivered")

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        point.enter(token)


class CompositeExecutionAspect(ExecutionAspect):
    """An aspect at actors that is a model: each firing is a request to a composite, and happens when it answers.

    Events: ``requested``, with the execution time; ``executed``, with the seconds since.  A request that is never
    answered is a firing that never happens.  Ptolemy: ``CompositeExecutionAspect``.
    """

    events: ClassVar[tuple[str, ...]] = ("requested", "executed")
    is_processor: ClassVar[bool] = True

    def schedule(self, job: Job, point: ActorPoint) -> None:
        point.enter(job)
