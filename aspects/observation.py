"""Observation: aspects that attach to any port, observe tokens, and change neither a token nor its time."""

from __future__ import annotations

from typing import Any, ClassVar

from epicycle.actors import EpicycleError, Parameter
from epicycle.actors.expression import PortFormulaParameter, text_of

from .core import TOKEN, JoinPoint, ObservationAspect

NOTE, STOP, FAIL = "note", "stop", "fail"
MOST_VALUES = 100  # distinguished by Count: the summary is for people


class InvariantError(EpicycleError):
    """A model has violated an invariant."""


class Probe(ObservationAspect):
    """Records every token that passes, in the signal ``NAME@PORT`` of the results and in the log.  Event: ``seen``."""

    events: ClassVar[tuple[str, ...]] = ("seen",)

    def observe(self, token: Any, point: JoinPoint) -> None:
        point.record(token)
        point.act("seen", token)


class Count(ObservationAspect):
    """Counts the tokens that pass, in the summary only: the log does not grow.

    Event: ``counted``; with ``by`` also ``counted VALUE`` for each value of the expression; after a hundred values, all
    others are ``counted others``.
    """

    events: ClassVar[tuple[str, ...]] = ("counted",)

    by = PortFormulaParameter(
        None,
        given=(TOKEN,),
        doc="expression over the passing token and ports; each of its values is counted separately, such as "
        "token.kind or token > 3",
    )

    def observe(self, token: Any, point: JoinPoint) -> None:
        point.count("counted")
        if self.by is None:
            return
        event = f"counted {text_of(point.value_of(self.by, token=token))}"
        known = point.shared.setdefault("values", set())
        if len(known) < MOST_VALUES:
            known.add(event)
        point.count(event if event in known else "counted others")


class Assert(ObservationAspect):
    """Checks an invariant for every token that passes.

    The invariant is not checked until all the ports in it have sent a token.  Event: ``violated``.  At the first
    violation, ``on_violation: stop`` ends the run after the present tag, with results; ``fail`` ends it with an
    ``InvariantError``.
    """

    events: ClassVar[tuple[str, ...]] = ("violated",)

    that = PortFormulaParameter(
        given=(TOKEN,),
        doc="expression over the passing token and ports, such as token.speed <= 8 and main.state.position[0] < 20",
    )
    on_violation = Parameter(
        str,
        NOTE,
        choices=(NOTE, STOP, FAIL),
        doc="effect of a violation in addition to the event: nothing, or the end of the run",
    )

    def observe(self, token: Any, point: JoinPoint) -> None:
        assert self.that is not None
        holds = point.value_of(self.that, token=token)
        if holds is None or holds:
            return
        point.act("violated", token)
        if self.on_violation == STOP:
            point.stop()
        elif self.on_violation == FAIL:
            raise InvariantError(f"the invariant {self.that.source!r} does not hold for the token {token!r}")
