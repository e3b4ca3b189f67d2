"""Borders: how variables flow in a mode, which comparisons hold, and when the next one changes."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any, Final

from ..core import NEVER, EpicycleError, to_nanoseconds
from ..expression import Formula
from ..integration import State
from ..solution import sign_of
from ..trajectory import Trajectory, number_of
from .condition import Comparison

_LONGEST: Final = 9e9  # s, of the times that there are
_STILL: Final = "_still"  # a state that does not move, where comparisons change with time, but nothing flows


class Borders:
    """Of the mode that a machine is in: the solution of its flow, and the comparisons in its guards.

    ``known`` are the values of variables and held inputs, which it brings up to date.  ``truths`` say which comparisons
    hold, by their names; one that asks for an input without a value is not among them.  Times are in ns.
    """

    def __init__(self, known: dict[str, Any], **solver: Any) -> None:
        self.truths: dict[str, float] = {}
        self._known = known
        self._solver = solver
        self._mode = ""
        self._entered = 0
        self._all: Sequence[Comparison] = ()
        self._flow: Mapping[str, Formula] = {}
        self._trajectory: Trajectory | None = None
        self._watched: list[Comparison] = []  # by the guards of the trajectory
        self._deadlines: dict[Comparison, int] = {}  # of those that wait for a time alone
        self._seen = 0  # when it has been looked at last
        self._open: dict[Comparison, int] = {}  # those that a transition has put on their border: where they came from
        self._passed: dict[Formula, int] = {}  # what crosses now, and to which side
        self._before: dict[str, Any] = {}  # the variables as they were there

    def enter(self, mode: str, flow: Mapping[str, Formula], comparisons: Sequence[Comparison], now: int) -> None:
        """Begin with a mode, with what the variables are now."""
        origin = now, 0.0
        if self._trajectory is not None and self._passed:
            origin = self._trajectory.time, self._trajectory.fraction
        self._mode, self._flow, self._all, self._entered, self._seen = mode, flow, comparisons, now, now
        self._open = {}
        self._begin(origin, now)

    def _begin(self, origin: tuple[int, float], now: int) -> None:
        known = [each for each in self._all if each.names <= self._known.keys()]
        self._watched = [each for each in known if each.until is None]
        self._deadlines = {each: self._deadline(each) for each in known if each.until is not None}
        self.truths, self._trajectory = {}, None
        self._judge_times(now)
        if not (self._flow or self._watched):
            return
        flow = dict(self._flow)
        if not flow:
            flow[_STILL], self._known[_STILL] = Formula("0"), 0.0
        self._trajectory = Trajectory(flow, self._known, {"mode_time": self._entered}, **self._solver)
        for each in self._watched:
            self._trajectory.watch(each.difference, f"mode {self._mode}")
        start = [float(self._known[name]) for name in self._trajectory.names]
        self._trajectory.begin(*origin, start)
        self._find_sides(self._trajectory, start)

    def _deadline(self, comparison: Comparison) -> int:
        assert comparison.until is not None
        clock, until, _ = comparison.until
        seconds = number_of(until, self._known, repr(comparison.source))
        at = NEVER if seconds > _LONGEST else to_nanoseconds(seconds)
        return min(at + (self._entered if clock == "mode_time" else 0), NEVER)

    def _find_sides(self, trajectory: Trajectory, start: State) -> None:
        is_moved = any(self._known[name] != self._before.get(name) for name in trajectory.names)
        for comparison, guard in zip(self._watched, trajectory.guards, strict=True):
            passed = self._passed.get(comparison.difference, 0)
            guard.side = sign_of(guard.value(0.0, start))
            if passed and not is_moved:
                guard.side = passed  # by rounding it may be a hair before its border
            elif passed and guard.side != -passed:
                guard.side, self._open[comparison] = 0, -passed  # the solution will show
        self._judge(trajectory, 0.0)

    def change(self, names: Collection[str], now: int) -> None:
        """Held inputs have other values now."""
        used = {name for each in self._flow.values() for name in each.names}
        if not used.union(*(each.names for each in self._all)).isdisjoint(names):
            self._open = {}
            self._begin((now, 0.0), now)

    # -- time -----------------------------------------------------------------------------------------------------

    def advance(self, now: int) -> bool:
        """Bring variables and comparisons to the present; whether a comparison changes now."""
        self._passed, trajectory = {}, self._trajectory
        has_changed = any(self._seen < time <= now for time in self._deadlines.values())
        self._seen = now
        self._judge_times(now)
        if trajectory is None:
            return has_changed
        solution, at = trajectory.solution, trajectory.elapsed(now)
        if self._watched:
            solution.search(at)
            crossing = solution.crossing
            if crossing is not None and trajectory.moment(crossing.time) <= now:
                self._cross(trajectory, crossing.time, crossing.sides)
                return True
        self._keep(trajectory, solution.at(at))
        self._judge(trajectory, at)
        return has_changed

    def _cross(self, trajectory: Trajectory, at: float, sides: Mapping[int, int]) -> None:
        state = trajectory.solution.at(at)
        trajectory.solution.rewind(at)
        self._keep(trajectory, state)
        for number, side in sides.items():
            comparison = self._watched[number]
            self._passed[comparison.difference] = trajectory.guards[number].side = side
            self._open.pop(comparison, None)
        self._before = dict(self._known)
        trajectory.begin_at(at, state)
        self._judge(trajectory, 0.0)

    def _keep(self, trajectory: Trajectory, state: State) -> None:
        """Know the variables as they are now."""
        self._known.update(zip(trajectory.names, state, strict=True))

    def next_time(self, now: int) -> int | None:
        """When to look again: where a comparison changes or, while none is in sight, where the search for it ends."""
        looks = [time for time in self._deadlines.values() if now < time < NEVER]
        if self._trajectory is not None and self._watched:
            looks.append(self._trajectory.next_look(now))
        return min(looks, default=None)

    # -- which comparisons hold -----------------------------------------------------------------------------------

    def _judge_times(self, now: int) -> None:
        for comparison, time in self._deadlines.items():
            assert comparison.until is not None
            side = comparison.until[2] if now >= time else -comparison.until[2]
            side = 0 if now == time and comparison.is_equality else side
            self.truths[comparison.name] = float(comparison.holds(side))

    def _judge(self, trajectory: Trajectory, at: float) -> None:
        for comparison, guard in zip(self._watched, trajectory.guards, strict=True):
            side = guard.side
            if side == 0:
                side = self._open.get(comparison) or sign_of(guard.value(at, trajectory.solution.at(at)))
            elif self._open.pop(comparison, side) != side:
                raise EpicycleError(
                    f"in mode {self._mode!r}, {comparison.source!r} is on its border again at once after a transition "
                    "that took it off: it may go on so without end (Zeno); leave the mode before"
                )
            if comparison.difference in self._passed and comparison.is_equality:
                side = 0  # which is where it crosses
            self.truths[comparison.name] = float(comparison.holds(side))
