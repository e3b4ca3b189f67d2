"""Acts of aspects one by one: they are noted by name, and all but some of them can be left out.

Where an act is left out, the aspect is told of the token as ever: it draws the same random numbers and remembers the
same, so that its other acts stay what they are.  But whatever it does with this token is lost, now and later, and the
token goes on at once.
"""

from __future__ import annotations

import hashlib
from collections.abc import Container, Mapping
from dataclasses import replace
from typing import Any

from epicycle.actors import Receiver, Tag
from epicycle.aspects import JoinPoint

from ...model.graph.acts import Act, ActName
from ..results import canonical
from .director import Director
from .errors import ActorError, LoopError
from .receivers import AspectCall


class Interventions:
    """The acts of a run: those that happen, if ``exactly`` names some, and those that have been ``noted``.

    Those in ``without`` do not happen.  ``ends`` are aspects that are no longer active from a tag on.  All acts of the
    aspects in ``always`` happen.
    """

    def __init__(
        self,
        exactly: Container[ActName] | None = None,
        *,
        without: Container[ActName] = (),
        ends: Mapping[str, Tag] | None = None,
        always: Container[str] = (),
    ) -> None:
        self.exactly = exactly
        self._without, self._ends, self._always = without, ends or {}, always
        self._noted: dict[ActName, Act] = {}
        self._passed: dict[tuple[str, str], int] = {}

    @property
    def noted(self) -> list[Act]:
        """All acts so far, in the order in which they began."""
        return list(self._noted.values())

    def anew(self) -> Interventions:
        """The same rules, before a run."""
        return Interventions(self.exactly, without=self._without, ends=self._ends, always=self._always)

    def happens(self, name: ActName) -> bool:
        """Whether an act is to happen."""
        if name.aspect in self._always:
            return True
        return name not in self._without and (self.exactly is None or name in self.exactly)

    def is_over(self, aspect: str, tag: Tag) -> bool:
        """Whether an aspect is no longer active."""
        end = self._ends.get(aspect)
        return end is not None and tag >= end

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
        self.happens = acts.happens(self._name)

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
    """An aspect at a place, whose acts have names; ``director`` has the time of the model."""

    __slots__ = ("acts", "aspect_call", "director")

    def __init__(self, aspect_call: AspectCall, acts: Interventions, director: Director) -> None:
        self.aspect_call = aspect_call
        self.acts = acts
        self.director = director

    def put(self, token: Any) -> None:
        call = self.aspect_call
        if self.acts.is_over(call.point.aspect, self.director.tag):
            self._pass_by(call, token)
            return
        handling = Handling(self.acts, call.point, token)
        call.show(token, call.point.during(handling))
        handling.end()

    @staticmethod
    def _pass_by(call: AspectCall, token: Any) -> None:
        try:
            call.aspect.pass_by(token, call.point)
        except (ActorError, LoopError):  # of something behind it
            raise
        except Exception as error:
            raise call.point.blame(f"pass_by() at {call.point.port}", error) from error
