"""Follows the flow of variables in a mode: which comparisons hold, and when the next one changes."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any, Final

from ..core import NEVER, EpicycleError, to_nanoseconds
from ..expression import Formula
from ..integration import State
from ..solution import sign_of
from ..trajectory import Trajectory, number_of
from .condition import Comparison

_LONGEST: Final = 9e9  # s, of all times that occur
_STILL: Final = "_still"  # a constant state, for modes where comparisons change with time but nothing flows


class Borders:
    """The solution of the flow of the current mode, and the comparisons in its guards.

    ``known`` holds the values of variables and held inputs, and is kept up to date.  ``truths`` states by name which
    comparisons hold; comparisons that use an input without a value are not in it.  Times are in ns.
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
        self._trajectories: dict[tuple[str, int], Trajectory] = {}  # of all modes so far
        self._watched: list[Comparison] = []  # in the order of the trajectory's guards
        self._deadlines: list[tuple[int, Comparison]] = []  # of comparisons that only wait for a time
        self._seen = 0  # time of the last update
        self._open: dict[Comparison, int] = {}  # put on their border by a transition: the side they came from
        self._passed: dict[Formula, int] = {}  # what crosses now, and towards which side
        self._before: dict[str, Any] = {}  # the variables at the crossing
        self.is_still = True  # whether nothing changes with time

    def enter(self, mode: str, flow: Mapping[str, Formula], comparisons: Sequence[Comparison], now: int) -> None:
        """Enter a mode with the present values of the variables."""
        origin = now, 0.0
        if self._trajectory is not None and self._passed:
            origin = self._trajectory.time, self._trajectory.fraction
        self._mode, self._flow, self._all, self._entered, self._seen = mode, flow, comparisons, now, now
        self._open = {}
        self.is_still = not (flow or comparisons or self._passed)
        self._begin(origin, now)

    def _begin(self, origin: tuple[int, float], now: int) -> None:
        self._watched, self._deadlines, self.truths, self._trajectory = [], [], {}, None
        for each in self._all:
            if not each.names <= self._known.keys():
                continue
            if each.until is None:
                self._watched.append(each)
            else:
                self._deadlines.append((self._deadline(each, *each.until), each))
        self._judge_times(now)
        if not (self._flow or self._watched):
            return
        key = self._mode, len(self._watched)  # of the comparisons of a mode, more become known, and none less
        if key not in self._trajectories:
            self._trajectories[key] = self._new_trajectory()
        self._trajectory = self._trajectories[key]
        self._trajectory.since["mode_time"] = self._entered
        start = [float(self._known[name]) for name in self._trajectory.names]
        self._trajectory.begin(*origin, start)
        self._find_sides(self._trajectory, start)

    def _new_trajectory(self) -> Trajectory:
        flow = dict(self._flow)
        if not flow:
            flow[_STILL], self._known[_STILL] = Formula("0"), 0.0
        trajectory = Trajectory(flow, self._known, ("mode_time",), **self._solver)
        for each in self._watched:
            trajectory.watch(each.difference, f"mode {self._mode}")
        return trajectory

    def _deadline(self, comparison: Comparison, clock: str, until: Formula, side: int) -> int:
        seconds = number_of(until, self._known, comparison)
        at = NEVER if seconds > _LONGEST else to_nanoseconds(seconds)
        return min(at + (self._entered if clock == "mode_time" else 0), NEVER)

    def _find_sides(self, trajectory: Trajectory, start: State) -> None:
        is_moved = any(self._known[name] != self._before.get(name) for name in trajectory.names)
        for comparison, guard in zip(self._watched, trajectory.guards, strict=True):
            passed = self._passed.get(comparison.difference, 0)
            guard.side = sign_of(guard.value(0.0, start))
            if passed and not is_moved:
                guard.side = passed  # rounding may have left it just before its border
            elif passed and guard.side != -passed:
                guard.side, self._open[comparison] = 0, -passed  # the solution will show
        self._judge(trajectory, 0.0)

    def change(self, names: Collection[str], now: int) -> None:
        """Take note that these held inputs have new values."""
        used = {name for each in self._flow.values() for name in each.names}
        if not used.union(*(each.names for each in self._all)).isdisjoint(names):
            self._open = {}
            self._begin((now, 0.0), now)

    # -- time -----------------------------------------------------------------------------------------------------

    def advance(self, now: int) -> bool:
        """Bring variables and comparisons up to date; return whether a comparison changes now."""
        self._passed, trajectory = {}, self._trajectory
        has_changed, seen, self._seen = False, self._seen, now
        for time, _ in self._deadlines:
            if seen <= time <= now:
                has_changed = has_changed or seen < time
                self._judge_times(now)
        if trajectory is None:
            self.is_still = not self._all
            return has_changed
        solution, at = trajectory.solution, trajectory.elapsed(now)
        if not self._watched:
            self._keep(trajectory, solution.at(at))
            return has_changed
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
        """Store the present values of the variables."""
        self._known.update(zip(trajectory.names, state, strict=True))

    def next_time(self, now: int) -> int | None:
        """When to check again: when a comparison changes or, if none is known to change, where the search ends."""
        looks = [time for time, _ in self._deadlines if now < time < NEVER]
        if self._trajectory is not None and self._watched:
            looks.append(self._trajectory.next_look(now))
        return min(looks) if looks else None

    # -- which comparisons hold -----------------------------------------------------------------------------------

    def _judge_times(self, now: int) -> None:
        for time, comparison in self._deadlines:
            assert comparison.until is not None
            side = comparison.until[2] if now >= time else -comparison.until[2]
            side = 0 if now == time and comparison.is_equality else side
            self.truths[comparison.name] = comparison.holds(side)

    def _judge(self, trajectory: Trajectory, at: float) -> None:
        for comparison, guard in zip(self._watched, trajectory.guards, strict=True):
            side = guard.side
            if side == 0:
                side = self._open.get(comparison) or sign_of(guard.value(at, trajectory.solution.at(at)))
            elif self._open.pop(comparison, side) != side:
                raise EpicycleError(
                    f"in mode {self._mode!r}, {comparison.source!r} returned to its border at once after a transition "
                    "had moved it off: it may repeat without end (Zeno); leave the mode earlier"
                )
            if comparison.difference in self._passed and comparison.is_equality:
                side = 0  # which is where it crosses
            self.truths[comparison.name] = comparison.holds(side)
