"""Aspects of what passes ports: communication, measurement, and observation of both."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

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
