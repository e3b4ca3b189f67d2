"""Aspects that are models: how tokens get into their composites, and back to where they were going."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from epicycle.actors import EpicycleError, Receiver, to_nanoseconds, to_seconds
from epicycle.aspects import FiringRequest, Job, JoinPoint, Request, time_needed

from ...model.graph.woven import WovenAspect
from .receivers import Call, Deliver


class Requests:
    """The requests to the composite of one aspect; a request says by which way its token goes on."""

    def __init__(self, woven: WovenAspect) -> None:
        assert woven.model is not None
        self.name = woven.name
        self.model = woven.model
        self.entries: dict[str, Deliver] = {}  # where requests enter, by the place that they come from
        self._ways: dict[str, list[JoinPoint]] = {}
        self._jobs: dict[tuple[str, int], Job] = {}  # the firings that wait for an answer, by actor and number
        self._number: dict[str, int] = {}  # how many firings of an actor there were

    def add_way(self, point: JoinPoint, place: str) -> Callable[[Any], None]:
        """A further way through a place, to everything behind a port or to one channel: where its tokens enter."""
        ways = self._ways.setdefault(place, [])
        ways.append(point)
        return partial(self._ask_for_firing if place in self.model.times else self._ask, point, place, len(ways) - 1)

    def _ask_for_firing(self, point: JoinPoint, place: str, way: int, job: Job) -> None:
        number = self._number[place] = self._number.get(place, -1) + 1
        self._jobs[place, number] = job
        seconds = time_needed(self.model.times[place], job, point.random) or 0.0
        self.entries[place](FiringRequest(None, "", place, point.now, self.name, number, seconds))

    def _ask(self, point: JoinPoint, place: str, way: int, token: Any) -> None:
        self.entries[place](Request(token, point.source, place, point.now, self.name, way))

    def told(self, place: str, onward: Receiver) -> Receiver:
        """The way of requests from a place onward; each is an act when it goes there."""
        return Call(partial(self._come_in, place, onward))

    def _come_in(self, place: str, onward: Receiver, request: Any) -> None:
        is_firing = isinstance(request, FiringRequest)
        point = self._ways[place][0 if is_firing else request.way]
        point.act("requested", request.execution_time if is_firing else request.token)
        onward.put(request)

    def answer(self, request: Any) -> None:
        """Take what the composite sends from its response port; raises ``EpicycleError`` if it is not a request."""
        if not isinstance(request, Request):
            raise EpicycleError(
                f"{self.model.response} sends {request!r}, which is not a request: an aspect that is a model must send "
                "back the requests that it receives, with another token in them if needed"
            )
        ways = self._ways.get(request.port, []) if request.aspect == self.name else []
        if ways and isinstance(request, FiringRequest):
            job = self._jobs.pop((request.port, request.way), None)
            if job is not None:
                ways[0].act("executed", self._since(request, ways[0]))
                ways[0].forward(job)
                return
        if isinstance(request, FiringRequest) or not 0 <= request.way < len(ways):
            raise EpicycleError(
                f"{self.model.response} sends {request!r}, but no such request to {self.name} waits for an answer"
            )
        point = ways[request.way]
        point.act("delivered", request.token, self._since(request, point))
        point.forward(request.token)

    def _since(self, request: Request, point: JoinPoint) -> float:
        """The seconds since a request."""
        return to_seconds(point.tag.time - to_nanoseconds(request.time))
