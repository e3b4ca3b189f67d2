"""Visits: an aspect that is watched while a model runs."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from epicycle.aspects import Aspect, ExecutionAspect, JoinPoint, Unit


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
        setattr(self.aspect, "pass_token", partial(self._pass_token, aspect))  # noqa: B010 (they are methods)
        setattr(self.aspect, "pass_by", partial(self._pass_by, aspect))  # noqa: B010
        if isinstance(aspect, ExecutionAspect):
            setattr(self.aspect, "begin", partial(self._begin, aspect))  # noqa: B010

    def demand_some(self, at: str | Sequence[str]) -> None:
        """Raise ``AssertionError`` if nothing has passed."""
        if self.count == 0:
            raise AssertionError(
                f"nothing has passed {self._original!r} at {at}, so nothing is shown: let it run longer"
            )

    def _pass_token(self, original: Aspect, token: Any, point: JoinPoint) -> None:
        self.count += 1
        if point.port not in self.streams:
            self.streams[point.port] = repr(point.random)
        self._do(original.pass_token, token, point)

    def _pass_by(self, original: Aspect, token: Any, point: JoinPoint) -> None:
        self._do(original.pass_by, token, point)

    def _begin(self, original: ExecutionAspect, unit: Unit) -> None:
        assert isinstance(self._original, ExecutionAspect)
        muted = self._muted(unit, () if self._acts else ("suspend", "resume", "kill", "restart"))
        assert isinstance(muted, Unit)
        original.begin(muted)

    def _do(self, method: Callable[[Any, JoinPoint], None], token: Any, point: JoinPoint) -> None:
        known = self._points.get(point)
        if known is None:
            known = self._points[point] = self._muted(point)
        method(token, known)
        self.shares = self.shares or bool(point.shared)
        if not self._acts:
            point.forward(token)

    def _muted(self, point: JoinPoint, more: Sequence[str] = ()) -> JoinPoint:
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
