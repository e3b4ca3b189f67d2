"""Aspects that are models: how tokens get into their composites, and back to where they were going."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from epicycle.actors import EpicycleError, to_nanoseconds, to_seconds
from epicycle.aspects import JoinPoint, Request

from ..model import WovenAspect
from .local import Deliver


class Requests:
    """The requests to the composite of one aspect; a request says by which way its token goes on."""

    def __init__(self, woven: WovenAspect) -> None:
        assert woven.model is not None
        self.name = woven.name
        self.model = woven.model
        self.entries: dict[str, Deliver] = {}  # where requests come in, by the place that they come from
        self._ways: dict[str, list[JoinPoint]] = {}

    def add_way(self, point: JoinPoint, place: str) -> Callable[[Any, JoinPoint], None]:
        """A further way through a place, to all that is behind a port or to one channel: what to do with its tokens."""
        ways = self._ways.setdefault(place, [])
        way = len(ways)
        ways.append(point)

        def ask(token: Any, point: JoinPoint) -> None:
            point.act("requested", token)
            self.entries[place](Request(token, point.source, place, point.now, self.name, way))

        return ask

    def answer(self, request: Any) -> None:
        """Take what the composite sends from its response port; raises ``EpicycleError`` if that is no request."""
        if not isinstance(request, Request):
            raise EpicycleError(
                f"{self.model.response} sends {request!r}, which is no request: what leaves an aspect that is a model "
                "must be what came in, with another token in it if need be"
            )
        ways = self._ways.get(request.port, []) if request.aspect == self.name else []
        if not 0 <= request.way < len(ways):
            raise EpicycleError(f"{self.model.response} sends {request!r}, which is no request to {self.name}")
        point = ways[request.way]
        point.act("delivered", request.token, to_seconds(point.tag.time - to_nanoseconds(request.time)))
        point.forward(request.token)
