"""Aspects at ports, without actors and a director: tokens in at given times, tokens out."""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from epicycle.actors import Streams, Tag, declared_parameters
from epicycle.aspects import JoinPoint, Medium, Memory, Place, PortAspect, SelectionParameter

SECOND = 1_000_000_000


class _At:
    """The bench as seen from one port."""

    def __init__(self, bench: Bench, port: str) -> None:
        self.bench = bench
        self.port = port

    def __getattr__(self, name: str) -> Any:
        return getattr(self.bench, name)

    def forward(self, token: Any) -> None:
        self.bench.out.append((self.bench.tag.time / SECOND, self.port, token))


class Bench:
    """One aspect before the port ``a.port``, or several before ports of their names.

    ``out`` holds what comes out as (time in s, port, token), and ``acts`` what aspects note as (time in s, port,
    event, value).  ``world`` is what ports have sent last; patterns in parameters of an aspect select what they spell.
    """

    def __init__(
        self, aspect: PortAspect | None = None, seed: int = 1, world: dict[str, Any] | None = None, **ports: Medium
    ) -> None:
        self.world = world
        self.seed = seed
        self.streams = Streams(seed)
        self.tag = Tag(0, 1)
        self.source = "b.port" if aspect is not None else ""
        self.aspects: dict[str, PortAspect] = {"port": aspect} if aspect is not None else dict(ports)
        self.out: list[tuple[float, str, Any]] = []
        self.acts: list[tuple[float, str, str, Any]] = []
        self._agenda: list[tuple[int, int, int, Callable[[Any], None], Any]] = []
        self._count = itertools.count()
        self._shared: dict[Any, Any] = {}
        self.points: dict[str, JoinPoint] = {}

    def play(self, tokens: Iterable[Any], period: float = 1.0) -> Bench:
        """One token a period (ms), then all that is still on its way."""
        return self.play_at((index * period / 1000, "a.port", token) for index, token in enumerate(tokens))

    def play_at(self, tokens: Iterable[tuple[float, str, Any]]) -> Bench:
        """Tokens that come at a time (s) to a port; a name with a dot ends with that of the aspect."""
        for time, port, token in tokens:
            self._enter(round(time * SECOND), 1, self._pass, (port, token))
        while self._agenda:
            time, microstep, _, call, what = heapq.heappop(self._agenda)
            self.tag = Tag(time, microstep)
            call(what)
        return self

    @property
    def tokens(self) -> list[Any]:
        """What came out."""
        return [token for _, _, token in self.out]

    @property
    def passed(self) -> list[tuple[float, Any]]:
        """What came out, and when (ms)."""
        return [(round(time * SECOND) / 1e6, token) for time, _, token in self.out]

    @property
    def told(self) -> list[tuple[str, Any]]:
        """What was noted, without when and where."""
        return [(event, value) for _, _, event, value in self.acts]

    def of(self, event: str) -> list[Any]:
        """The values of one kind of act."""
        return [value for _, _, happened, value in self.acts if happened == event]

    def report(self) -> dict[str, float]:
        """What the media say at the end, all the same."""
        media = [each for each in self.aspects.values() if isinstance(each, Medium)]
        reports = [medium.report(self._shared, self.tag.time) for medium in media]
        assert all(report == reports[0] for report in reports)
        return {name: math.nan if value is None else value for name, value in reports[0].items()}

    def _enter(self, time: int, microstep: int, call: Callable[[Any], None], what: Any) -> None:
        heapq.heappush(self._agenda, (time, microstep, next(self._count), call, what))

    def _pass(self, what: tuple[str, Any]) -> None:
        port, token = what
        aspect = self.aspects[port.rpartition(".")[2]]
        point = self.points.get(port)
        if point is None:
            selections = {
                name: {each: [each] for each in parameter.patterns(getattr(aspect, name))}
                for name, parameter in declared_parameters(type(aspect)).items()
                if isinstance(parameter, SelectionParameter)
            }
            place = Place("it", port, port, self.source or port, selections=selections)
            point = self.points[port] = JoinPoint(place, Memory(self._shared), _At(self, port))
        aspect.pass_token(token, point)

    # What a join point asks of a run.

    def later(self, delay: int, deliver: Callable[[Any], None], token: Any) -> None:
        now = self.tag
        self._enter(now.time + delay, 1 if delay else now.microstep + 1, deliver, token)

    def latest(self, port: str) -> Any:
        assert self.world is not None, "nothing is read"
        return self.world.get(port)

    def hold(self, deliver: Callable[[Any], None], token: Any) -> Callable[[], None]:
        return partial(deliver, token)

    def note(self, place: Place, event: str, token: Any) -> None:
        self.acts.append((self.tag.time / SECOND, place.port, event, token))

    def record(self, signal: str, token: Any) -> None:
        raise AssertionError("nothing is recorded")

    def stop(self, reason: str) -> None:
        raise AssertionError("nothing ends the run")
