"""Aspect: what is woven around a model from outside, and the join points at which it acts.

The weaving contract
--------------------
The engine makes one aspect object per declaration and one ``JoinPoint`` for each port that its pointcut selects.
For every token that passes a join point it calls ``aspect.pass_token(token, point)``, which decides what goes on by
calling ``point.forward(token)`` never, once or several times, now or (with ``delay``) later, and what is noted by
calling ``point.act(...)``.  Doing exactly ``point.forward(token)`` leaves no trace.

Aspects at the same port apply in the order of their declaration, the first one outermost (nearest to the sender).
Each join point has a random stream of its own, keyed by the names of aspect and port: adding, removing or re-aiming
an aspect moves no stream of an actor, of another aspect, or of the same aspect at another port.  An aspect should
draw the same number of random values whatever its strength, so that runs at different strengths can be paired.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar, Protocol

import numpy as np

from epicycle.actors import Configurable, Tag, random_stream, to_nanoseconds, to_seconds


class Weaver(Protocol):
    """What the engine offers to a join point."""

    @property
    def tag(self) -> Tag:
        """The present tag."""

    @property
    def seed(self) -> int:
        """The seed of the run."""

    def later(self, delay: int, deliver: Callable[[Any], None], token: Any) -> None:
        """Call ``deliver(token)`` after ``delay`` ns; 0 is the next microstep."""

    def note(self, aspect: str, port: str, event: str, token: Any) -> None:
        """Write an act of an aspect into the event log."""


class JoinPoint:
    """One port that an aspect stands at.

    ``counts`` holds how often each event happened here; ``memory`` belongs to the aspect, for what it must remember
    about this port between tokens.
    """

    def __init__(self, aspect: str, port: str, weaver: Weaver, forward: Callable[[Any], None]) -> None:
        self.aspect = aspect
        self.port = port
        self.counts: dict[str, int] = {}
        self.memory: dict[Any, Any] = {}
        self.random: np.random.Generator = random_stream(weaver.seed, port, f"aspect {aspect}")
        self._weaver = weaver
        self._forward = forward

    @property
    def tag(self) -> Tag:
        """The present tag."""
        return self._weaver.tag

    @property
    def now(self) -> float:
        """The present time in seconds."""
        return to_seconds(self._weaver.tag.time)

    def forward(self, token: Any, delay: float | None = None) -> None:
        """Let a token pass, at once or after ``delay`` seconds (0 is the next microstep)."""
        if delay is None:
            self._forward(token)
        else:
            self._weaver.later(to_nanoseconds(delay), self._forward, token)

    def act(self, event: str, token: Any, *details: Any) -> None:
        """Count an event and write it into the event log: the token as it came, then what was done to it.

        Details are a new token or a delay in seconds; with details the logged value is a list.
        """
        self.counts[event] = self.counts.get(event, 0) + 1
        self._weaver.note(self.aspect, self.port, event, [token, *details] if details else token)


class Aspect(Configurable):
    """Base of all aspects: declare parameters in the class, write ``pass_token``.

    ``stands_at`` says which ports it can be woven around: inputs (communication), outputs (measurement), or both.
    ``events`` names what it may note, so that summaries show a zero where nothing happened.
    """

    reserved: ClassVar[frozenset[str]] = frozenset({"type", "at", "enabled"})
    stands_at: ClassVar[frozenset[str]] = frozenset({"input", "output"})
    events: ClassVar[tuple[str, ...]] = ()

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        """Decide what becomes of a token at a join point."""
        raise NotImplementedError(f"{type(self).__name__} has no pass_token()")


class CommunicationAspect(Aspect):
    """An aspect of the way to an input port."""

    stands_at: ClassVar[frozenset[str]] = frozenset({"input"})


class MeasurementAspect(Aspect):
    """An aspect of what leaves an output port."""

    stands_at: ClassVar[frozenset[str]] = frozenset({"output"})
