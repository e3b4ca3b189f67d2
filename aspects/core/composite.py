"""Aspects that are models: a composite through which the tokens of join points go before they go on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from .execution import ActorPoint, ExecutionAspect, Job
from .join_point import JoinPoint
from .port import PortAspect


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
