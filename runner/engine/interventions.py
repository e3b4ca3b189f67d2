"""Acts of aspects one by one: they are noted by name, and all but some of them can be left out.

Where an act is left out, the aspect is told of the token as ever: it draws the same random numbers and remembers the
same, so that its other acts stay what they are.  But whatever it does with this token is lost, now and later, and the
token goes on at once.
"""

from __future__ import annotations

import hashlib
from collections.abc import Container
from dataclasses import replace
from typing import Any

from epicycle.actors import Receiver
from epicycle.aspects import JoinPoint

from ..graph.acts import Act, ActName
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


class Handling:
    """What an aspect does to one token: its name, whether it ``happens``, and whether it is anything at all."""

    __slots__ = ("_acts", "_is_untouched", "_name", "_point", "_token", "happens")

    def __init__(self, acts: Interventions, point: JoinPoint, token: Any) -> None:
        self._acts = acts
        self._name = acts.next(point.aspect, point.place.key)
        self._point = point
        self._token = token
        self._is_untouched = False
        self.happens = acts.exactly is None or self._name in acts.exactly

    def forward(self, token: Any) -> None:
        """The aspect lets a token continue."""
        self._is_untouched = token is self._token and not self._is_untouched
        if self.happens:
            self._point.forward(token)

    def note(self, *events: str) -> None:
        """Something has happened to the token."""
        self._acts.note(self._name, self._point.source, self._point.tag.time, self._token, *events)

    def end(self) -> None:
        """The aspect has been told of the token."""
        if not self.happens:
            self._point.forward(self._token)
        elif not self._is_untouched:  # so far there may be nothing in the log
            self.note()


class NamedCall(Receiver):
    """An aspect at a place, whose acts have names."""

    __slots__ = ("acts", "aspect_call")

    def __init__(self, aspect_call: AspectCall, acts: Interventions) -> None:
        self.aspect_call = aspect_call
        self.acts = acts

    def put(self, token: Any) -> None:
        handling = Handling(self.acts, self.aspect_call.point, token)
        self.aspect_call.show(token, self.aspect_call.point.during(handling))
        handling.end()
