"""What the engine offers to aspects at their places."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from epicycle.actors import Tag

from ..results import EventLog, Signal
from .director import Director
from .errors import ActorError, CrowdError, LoopError
from .local_time import LocalDirector
from .receivers import Call, Deliver
from .refinement import Refinement


class EngineContext:
    """What the engine offers to a join point: the time of its director, the log and signals."""

    def __init__(
        self,
        local: Director | LocalDirector | Refinement,
        director: Director,
        log: EventLog,
        latest: dict[str, Any],
        signals: dict[str, Signal],
        blame: Callable[[Exception], ActorError],
    ) -> None:
        self.streams = director.streams
        self.latest = latest.get
        self.stop = director.stop
        self._blame = blame
        self._local = local
        self._director = director
        self._log = log
        self._signals = signals

    @property
    def tag(self) -> Tag:
        """The present tag."""
        return self._local.tag

    def later(self, delay: int, deliver: Deliver, token: Any) -> None:
        """Call ``deliver(token)`` after ``delay`` ns; 0 is the next microstep."""
        try:
            self._local.later(delay, Call(partial(self._deliver, deliver)), token)
        except CrowdError as error:
            raise error.of(self._blame(error).path) from None

    def hold(self, deliver: Deliver, token: Any) -> Callable[[], None]:
        """A later call of ``deliver(token)``."""
        return self._director.hold(Call(deliver), token).arrive

    def _deliver(self, deliver: Deliver, token: Any) -> None:
        try:
            deliver(token)
        except (ActorError, LoopError):  # of something behind it
            raise
        except Exception as error:
            raise self._blame(error) from error

    def note(self, aspect: str, owner: str, port: str, event: str, token: Any) -> None:
        """Write an act of an aspect into the log."""
        self._log.writer(event, owner, port, None, aspect).write(self._director.now(), token)

    def record(self, signal: str, token: Any) -> None:
        """Append a token to a signal of the results."""
        self._signals.setdefault(signal, Signal(signal)).add(self._director.tag, token)
