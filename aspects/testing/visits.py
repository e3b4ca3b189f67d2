"""Visits: an aspect that is watched while a model runs."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from functools import partial
from typing import Any, TypeVar

from epicycle.aspects import Aspect, ExecutionAspect, JoinPoint, JoinPointAspect, PortAspect, Unit

P = TypeVar("P", bound=JoinPoint)


class Visits:
    """An aspect that is watched: what passes it, and the random streams that it meets.

    With ``acts`` false nothing that it decides is done: each token goes on as it came, at once.  With ``tells`` false
    it leaves no trace in the log and the results.
    """

    def __init__(self, aspect: Aspect, *, acts: bool = True, tells: bool = True) -> None:
        self.count = 0
        self.streams: dict[str, str] = {}  # their states when the first token came, by port
        self.shares = False
        self.aspect = copy.copy(aspect)
        self._original = aspect
        self._acts = acts
        self._mutes = (*(() if acts else ("forward", "stop")), *(() if tells else ("act", "count", "record")))
        self._points: dict[JoinPoint, JoinPoint] = {}
        # Each run has a copy of the original, and tells this of it.
        decides = "pass_token" if isinstance(aspect, PortAspect) else "schedule"
        if isinstance(aspect, JoinPointAspect):
            setattr(self.aspect, decides, partial(self._pass, aspect, decides))
            setattr(self.aspect, "pass_by", partial(self._pass, aspect, "pass_by"))  # noqa: B010 (they are methods)
        if isinstance(aspect, ExecutionAspect):
            setattr(self.aspect, "begin", partial(self._begin, aspect))  # noqa: B010

    def demand_some(self, at: str | Sequence[str]) -> None:
        """Raise ``AssertionError`` if nothing has passed."""
        if self.count == 0:
            raise AssertionError(
                f"nothing has passed {self._original!r} at {at}, so nothing is shown: let it run longer"
            )

    def _begin(self, original: ExecutionAspect, unit: Unit) -> None:
        original.begin(self._muted(unit, () if self._acts else ("suspend", "resume", "kill", "restart")))

    def _pass(self, original: Aspect, method: str, passing: Any, point: JoinPoint) -> None:
        """Let the aspect do what it does with a token or a firing."""
        if method != "pass_by":
            self.count += 1
            if point.port not in self.streams:
                self.streams[point.port] = repr(point.random)
        known = self._points.get(point)
        if known is None:
            known = self._points[point] = self._muted(point)
        getattr(original, method)(passing, known)
        self.shares = self.shares or bool(point.shared)
        if not self._acts:
            point.forward(passing)

    def _muted(self, point: P, more: Sequence[str] = ()) -> P:
        if not self._mutes:
            return point
        muted = copy.copy(point)
        for method in (*self._mutes, *more):
            setattr(muted, method, _do_nothing)
        if not self._acts:
            setattr(muted, "hold", lambda token: _do_nothing)  # noqa: B010
        return muted


def _do_nothing(*_: object, **__: object) -> None:
    pass
