"""The lift of `lift_group` as an actor in Python, in place of its state machine: what an expression costs there."""

from __future__ import annotations

from typing import Any

from epicycle.actors import Actor, InputPort, OutputPort, Parameter, Wake


class Lift(Actor):
    """A lift that goes on in its direction as long as somebody ahead wants it, then turns round."""

    is_source = True

    call = InputPort(doc="a passenger who waits: origin, to, came")
    load = OutputPort(int, doc="how many it has to serve")
    height = OutputPort(int, doc="the floor that it has come to")
    entered = OutputPort(list, doc="who got on")
    left = OutputPort(list, doc="who got off")
    mode = OutputPort(str, doc="idle, moving or stopped")

    places = Parameter(int, 8, min=1, doc="passengers whom it carries")
    pace = Parameter(float, 2.0, unit="s", above=0, doc="how long it takes from one floor to the next")
    doors = Parameter(float, 6.0, unit="s", min=0, doc="how long a stop takes when nobody gets on or off")
    step = Parameter(float, 1.0, unit="s", min=0, doc="how much longer for each who does")

    def initialize(self) -> None:
        self._at, self._way, self._doing = 0, 1, "idle"
        self._calls: list[Any] = []
        self._aboard: list[Any] = []
        self._wake: Wake | None = self.wake_in(0)

    def fire(self) -> None:
        was_idle = self._doing == "idle"
        for person in self.call.tokens:
            self._calls = [*self._calls, person]
            self.load.send(len(self._calls) + len(self._aboard))
        if self._wake is not None and self._wake.due:
            self._wake = None
            if self._doing == "moving":
                self._at += self._way
                self.height.send(self._at)
            if not was_idle:
                self._decide()
        elif was_idle and self.call.present:
            self._decide()
        self.mode.send(self._doing)

    def _decide(self) -> None:
        """Turn, stop, go on or wait, at a floor with closed doors."""
        at, calls, aboard = self._at, self._calls, self._aboard
        goals = [each["origin"] for each in calls] + [each["to"] for each in aboard]
        ahead = [goal - at for goal in goals if (goal - at) * self._way > 0]
        here = [each["to"] - at for each in calls if each["origin"] == at]
        others = [goal - at for goal in goals if goal != at]
        self._way = way = 1 if [*ahead, *here, *others, self._way][0] > 0 else -1
        off = [each for each in aboard if each["to"] == at]
        room = self.places - len(aboard) + len(off)
        on = [each for each in calls if each["origin"] == at and (each["to"] - at) * way > 0][:room]
        if on or off:
            self._calls = [each for each in calls if each not in on]
            self._aboard = [each for each in aboard if each not in off] + on
            self.load.send(len(self._calls) + len(self._aboard))
            self.entered.send(on)
            self.left.send(off)
            self._doing, self._wake = "stopped", self.wake_in(self.doors + self.step * len(on + off))
        elif goals:
            self._doing, self._wake = "moving", self.wake_in(self.pace)
        else:
            self._doing = "idle"
