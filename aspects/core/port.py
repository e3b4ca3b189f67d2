"""Aspects of what passes ports: communication, measurement, observation, and losses of both."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

from epicycle.actors import Parameter

from .join_point import JoinPoint, JoinPointAspect


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
        first = point.memory.setdefault("first tag", point.tag) if self.spare_first else None
        return lost and point.tag != first


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
