"""What the engine offers to aspects at their places."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from epicycle.actors import Streams, Tag
from epicycle.aspects import Place

from ...model.text.program import describe
from ..results import EventLog, Signal
from .director import Director
from .errors import ActorError, CrowdError, LoopError
from .interventions import Handling
from .local_time import LocalDirector
from .receivers import Call, Deliver
from .refinement import Refinement


@dataclass(eq=False, slots=True)
class EngineContext:
    """What the engine offers to a join point: the time of its director, what is behind it, the log and signals.

    ``handling``, if set, is that of the only token that it is for: whether what the aspect does to it happens, and what
    is noted of it.
    """

    aspect: str
    port: str
    local: Director | LocalDirector | Refinement
    forward: Deliver  # to what is behind the aspect
    director: Director
    log: EventLog
    seen: dict[str, Any]  # the latest tokens of ports
    signals: dict[str, Signal]
    enter: Deliver = lambda token: None  # into the composite that the aspect is
    handling: Handling | None = None
    onward: Call | None = None  # the way of tokens that go forward later

    @property
    def tag(self) -> Tag:
        """The present tag."""
        return self.local.tag

    @property
    def streams(self) -> Streams:
        """The random streams of the run."""
        return self.director.streams

    def during(self, handling: Handling) -> EngineContext:
        """The same for one token."""
        made = copy.copy(self)
        made.handling, made.forward, made.onward = handling, handling.forward, None
        if not handling.happens:
            made.enter = handling.forward
        return made

    def later(self, delay: int, deliver: Deliver, token: Any) -> None:
        """Call ``deliver(token)`` after ``delay`` ns; 0 is the next microstep."""
        if self.handling is not None and not self.handling.happens and deliver == self.forward:
            return
        way = self.onward
        if way is None or deliver is not self.forward:
            way = Call(partial(self._deliver, deliver))
            if deliver is self.forward:
                self.onward = way
        try:
            self.local.later(delay, way, token)
        except CrowdError as error:
            raise error.of(f"aspect {self.aspect}") from None

    def hold(self, deliver: Deliver, token: Any) -> Callable[[], None]:
        """A later call of ``deliver(token)``."""
        return self.director.hold(Call(deliver), token).arrive

    def _deliver(self, deliver: Deliver, token: Any) -> None:
        try:
            deliver(token)
        except (ActorError, LoopError):  # of something behind it
            raise
        except Exception as error:
            raise self.blame(f"later() at {self.port}", error) from error

    def latest(self, port: str) -> Any:
        """The latest token of an output port; None if it has sent nothing yet."""
        return self.seen.get(port)

    def note(self, place: Place, event: str, token: Any) -> None:
        """Write an act of the aspect at a place into the log."""
        if self.handling is not None:
            if not self.handling.happens:
                return
            self.handling.note(event)
        writer = self.log.writer(event, place.owner, place.name, None, place.aspect)
        writer.write(self.director.now(), token)

    def record(self, signal: str, token: Any) -> None:
        """Append a token to a signal of the results."""
        if self._happens:
            self.signals.setdefault(signal, Signal(signal)).add(self.director.tag, token)

    def stop(self, reason: str) -> None:
        """End the run when the present tag has been handled; the first call gives the reason."""
        if self._happens:
            self.director.stop(reason)

    def blame(self, doing: str, error: Exception) -> ActorError:
        """The error to raise for one of the aspect, with what it was doing."""
        return ActorError(f"aspect {self.aspect}", self.director.tag, doing, describe(error))

    @property
    def _happens(self) -> bool:
        return self.handling is None or self.handling.happens
