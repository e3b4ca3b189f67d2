"""Acts of aspects one by one: they are noted by name, and all but some of them can be left out.

Where an act is left out, the aspect is told of the token as ever: it draws the same random numbers and remembers the
same, so that its other acts stay what they are.  But whatever it does with this token is lost, now and later, and the
token goes on at once.
"""

from __future__ import annotations

import copy
import hashlib
from collections.abc import Callable, Container
from dataclasses import replace
from typing import Any

from epicycle.actors import Receiver, Streams, Tag
from epicycle.aspects import AspectContext

from ..graph import Act, ActName
from ..results import canonical
from .receivers import AspectCall


class Interventions:
    """The acts of a run: those that happen, if ``exactly`` names some, and those that have been ``noted``."""

    def __init__(self, exactly: Container[ActName] | None = None) -> None:
        self.exactly = exactly
        self._noted: dict[ActName, Act] = {}
        self._passed: dict[tuple[str, str], int] = {}

    @property
    def noted(self) -> list[Act]:
        """All acts so far, in the order in which they began."""
        return list(self._noted.values())

    def next(self, aspect: str, place: str) -> ActName:
        """The name of what an aspect does next at a place."""
        number = self._passed[aspect, place] = self._passed.get((aspect, place), 0) + 1
        return ActName(aspect, place, number)

    def note(self, name: ActName, source: str, time: int, token: Any, *events: str) -> None:
        """An act has happened, or left something in the event log."""
        if (before := self._noted.get(name)) is None:
            before = Act(name, source, time, hashlib.sha256(canonical(token)).hexdigest()[:16], ())
        self._noted[name] = replace(before, events=(*before.events, *events))


class NamedCall(Receiver):
    """An aspect at a place, whose acts have names."""

    __slots__ = ("acts", "aspect_call", "key")

    def __init__(self, aspect_call: AspectCall, acts: Interventions, place: str) -> None:
        self.aspect_call = aspect_call
        self.acts = acts
        self.key = aspect_call.point.aspect, place

    def put(self, token: Any) -> None:
        name, point = self.acts.next(*self.key), self.aspect_call.point
        point.random  # noqa: B018 (or a copy would have a stream of its own)
        if self.acts.exactly is None or name in self.acts.exactly:
            passing = _Passing(token, point._forward)
            context = _Noting(point._context, self.acts, name, point.source, token)
            self._act(token, context, passing, point.enter, point.counts)
            if not passing.is_untouched:  # so far there may be nothing in the log
                context.note_it()
        else:
            self._act(token, _Silent(point._context), _lose, _lose, {})
            point._forward(token)

    def _act(
        self,
        token: Any,
        context: AspectContext,
        forward: Callable[[Any], None],
        enter: Callable[[Any], None],
        counts: dict[str, int],
    ) -> None:
        """Let the aspect act; what it keeps of this token, it keeps with a join point that is this token's."""
        aspect_call = self.aspect_call
        seen = copy.copy(aspect_call.point)
        seen._context, seen._forward, seen.enter, seen.counts = context, forward, enter, counts
        AspectCall(
            aspect_call.act, aspect_call.doing, seen, aspect_call.holds, aspect_call.pass_by, aspect_call.tell
        ).put(token)


class _Passing:
    """Lets a token go on, and sees whether that is all."""

    __slots__ = ("_forward", "_token", "is_untouched")

    def __init__(self, token: Any, forward: Callable[[Any], None]) -> None:
        self._token = token
        self._forward = forward
        self.is_untouched = False

    def __call__(self, token: Any) -> None:
        self.is_untouched = token is self._token and not self.is_untouched
        self._forward(token)


def _lose(token: Any) -> None:
    """What becomes of a token that has gone on already."""


class _Context:
    """What the engine offers to a join point, for one token."""

    def __init__(self, context: AspectContext) -> None:
        self._context = context

    @property
    def tag(self) -> Tag:
        return self._context.tag

    @property
    def streams(self) -> Streams:
        return self._context.streams

    def later(self, delay: int, deliver: Callable[[Any], None], token: Any) -> None:
        self._context.later(delay, deliver, token)

    def hold(self, deliver: Callable[[Any], None], token: Any) -> Callable[[], None]:
        return self._context.hold(deliver, token)

    def latest(self, port: str) -> Any:
        return self._context.latest(port)

    def note(self, aspect: str, owner: str, port: str, event: str, token: Any) -> None:
        self._context.note(aspect, owner, port, event, token)

    def record(self, signal: str, token: Any) -> None:
        self._context.record(signal, token)

    def stop(self, reason: str) -> None:
        self._context.stop(reason)


class _Noting(_Context):
    """Notes what is done to a token under its name."""

    def __init__(self, context: AspectContext, acts: Interventions, name: ActName, source: str, token: Any) -> None:
        super().__init__(context)
        self._acts = acts
        self._name = name
        self._source = source
        self._token = token

    def note_it(self, *events: str) -> None:
        self._acts.note(self._name, self._source, self._context.tag.time, self._token, *events)

    def note(self, aspect: str, owner: str, port: str, event: str, token: Any) -> None:
        self.note_it(event)
        self._context.note(aspect, owner, port, event, token)


class _Silent(_Context):
    """Lets nothing come of what is done to a token."""

    def later(self, delay: int, deliver: Callable[[Any], None], token: Any) -> None:
        if deliver is not _lose:
            self._context.later(delay, deliver, token)

    def note(self, aspect: str, owner: str, port: str, event: str, token: Any) -> None:
        pass

    def record(self, signal: str, token: Any) -> None:
        pass

    def stop(self, reason: str) -> None:
        pass
