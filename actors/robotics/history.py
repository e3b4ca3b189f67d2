"""The past of a filter, to which late data comes at its own time."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterable
from operator import attrgetter
from typing import Any

from ..core import to_nanoseconds, to_seconds

_time, _robot = attrgetter("time"), attrgetter("robot")


class Step:
    """What a filter fused at one time, and its state then."""

    __slots__ = ("after", "data", "time")

    def __init__(self, time: int) -> None:
        self.time = time  # ns
        self.data: list[Any] = []  # tokens with a robot and a time
        self.after: Any = None


class History:
    """The latest steps of a filter: a late token is inserted at its own time, and the filter runs again from there.

    Later states are, to the bit, those of a filter that got it in time.  (Formulas for such out-of-sequence
    measurements, as by Bar-Shalom, IEEE Trans. Aerosp. Electron. Syst. 38, 2002, spare the second run and are exact for
    linear models.)  A copy of a known token has no effect.  Tokens of one time are sorted, so that the order of arrival
    has no influence, not even on the last bit.
    """

    def __init__(self, prior: Any, order: Callable[[Any], Any], max_delay: float) -> None:
        """``order`` sorts tokens and tells which are the same, beginning with their robots; delays are in s."""
        self.steps: list[Step] = []  # of the last ``max_delay``, and the state before them, with its time
        self.before = prior
        self.before_at: int | None = None  # None: it is the prior, at any time
        self.too_late = 0  # tokens so far that came more than ``max_delay`` late
        self._waiting: list[Any] = []  # for the next run
        self._order = order
        self._kept = to_nanoseconds(max_delay)

    def take(self, tokens: Iterable[Any], now: int) -> bool:
        """Keep tokens for the next run; returns whether one was too late."""
        come, earliest = [*self._waiting, *tokens], now - self._kept
        self._waiting = [each for each in come if to_nanoseconds(each.time) >= earliest]
        lost = len(come) - len(self._waiting)
        self.too_late += lost
        return lost > 0

    def run(self, now: int, advance: Callable[[Any, float, Step], tuple[Any, bool]]) -> tuple[Any, set[str]]:
        """The state at present, and the robots of new tokens that were used.

        ``advance`` gives the state a number of seconds after another one, with the data of a step, and whether it was
        used.  A token from the future, due to a wrong clock, counts as made now.
        """
        steps, new = self.steps, []
        first = self._place_of(now)  # of the first changed step
        for token in self._waiting:
            place = self._place_of(min(to_nanoseconds(token.time), now))
            step = steps[place]
            if all(known.robot != token.robot or self._order(known) != self._order(token) for known in step.data):
                step.data.append(token)
                new.append((step, token.robot))
                first = min(first, place)
        self._waiting = []
        state, before = (steps[first - 1].after, steps[first - 1].time) if first else (self.before, self.before_at)
        heard = set()
        for step in steps[first:]:
            elapsed = 0.0 if before is None else to_seconds(step.time - before)
            robots = {each.robot for each in step.data}
            step.data.sort(key=_robot if len(robots) == len(step.data) else self._order)
            state, used = advance(state, elapsed, step)
            if used:
                heard |= {robot for where, robot in new if where is step}
            step.after, before = state, step.time
        return state, heard

    def _place_of(self, time: int) -> int:
        """The index of the step at that time, which may be new."""
        steps = self.steps
        place = len(steps)
        if steps and time <= steps[-1].time:  # usually the last one, or a new one
            place = place - 1 if time == steps[-1].time else bisect_left(steps, time, key=_time)
        if place == len(steps) or steps[place].time != time:
            steps.insert(place, Step(time))
        return place

    def forget(self, now: int) -> bool:
        """Forget the steps that no token can change any longer; returns whether there were any."""
        earliest = now - self._kept
        if self.steps[0].time >= earliest:  # there is at least the present one
            return False
        count = bisect_left(self.steps, earliest, key=_time)
        last = self.steps[count - 1]
        self.before, self.before_at = last.after, last.time
        del self.steps[:count]
        return True
