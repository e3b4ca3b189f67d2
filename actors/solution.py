"""Solution: the solution of an ODE after a discontinuity, and the zero crossings of guard functions along it.

The steps, and with them every digit, do not depend on when the solution is evaluated.  Between the points at which a
function is evaluated, anything may hide; if no longest step is given, interval arithmetic finds where nothing does.
There, steps are as long as the tolerances allow, and guards are not checked; elsewhere the solution and its guards are
sampled within ``WINDOW``.
"""

from __future__ import annotations

import copy
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Final, NamedTuple

from .core import EpicycleError
from .integration import STEPPERS, Bounds, Derivative, Euler, Exact, Limits, Piece, State, Stepper

WINDOW: Final = 1.0  # s, within which things may hide
CELLS: Final = 8  # parts of a window in which changes of sign are searched
LONGEST: Final = 1e6  # s, of a step
_HALVINGS: Final = 12
_NOISE: Final = 1e-11  # relative to the value at the far end of a cell, this counts as zero
_MAX_PATIENCE: Final = 64
_PRECISION: Final = sys.float_info.epsilon
_BISECTIONS: Final = 200  # more steps than bisection alone needs to find a root


@dataclass
class Guard:
    """A function whose zero crossings count; ``side`` is its last sign, 0 if undecided.

    ``bounds`` gives the bounds of the function from one time to another, for states between bounds.
    """

    value: Callable[[float, State], float]
    bounds: Callable[[float, float, Sequence[Bounds]], Bounds]
    rising: bool
    falling: bool
    side: int = 0

    def counts(self, side: int) -> bool:
        """Whether a crossing to this side counts."""
        return self.rising if side > 0 else self.falling


class Crossing(NamedTuple):
    """The first zero crossing of guards: the time, and for each guard that crosses, its number and the side it crosses
    to."""

    time: float
    sides: dict[int, int]


class Solution:
    """A solution that starts at time 0 and is extended on request, or searched up to the first crossing.

    ``rates`` gives the derivatives of the states at a time, ``bounds`` their bounds for times and states between
    bounds.  Without ``max_step``, a step is longer than ``WINDOW`` only if nothing can hide in it.  If the solution is
    known, it is given as ``exact``.
    """

    def __init__(
        self,
        rates: Derivative,
        bounds: Callable[[float, float, Sequence[Bounds]], list[Bounds]],
        state: State,
        guards: Sequence[Guard],
        *,
        method: str,
        tolerance: tuple[float, float],
        max_step: float | None,
        exact: Exact | None = None,
    ) -> None:
        self._rates, self._bounds = rates, bounds
        self._window = WINDOW if max_step is None else max_step
        self._patience, self._taken = 1, 0  # steps to take before longer ones are tried; steps taken
        self._watched: Stepper | None = None  # the stepper, if it must not pass over anything
        self.stepper: Stepper | Euler | Exact
        if exact is not None:
            self.stepper = exact
        else:
            limits = Limits(*tolerance, LONGEST if max_step is None else max_step)
            self.stepper = stepper = STEPPERS[method](rates, state, limits)
            self._watched = stepper if max_step is None and isinstance(stepper, Stepper) else None
        self._guards = guards
        self._start = state
        self._piece: Piece | Exact | None = None
        self._before: Piece | Exact | None = None  # a request for the past may reach back by a fraction of a nanosecond
        self._ahead: list[
            tuple[float, float, list[int]]
        ] = []  # parts still to be searched, with their guards; the next one last
        self._turns: list[tuple[float, float, Guard, int]] = []  # from, to, and the side of a guard before
        self.searched = 0.0
        self.crossing: Crossing | None = None

    @property
    def end(self) -> float:
        """The time up to which the solution is known."""
        return self.stepper.time

    def extend(self) -> None:
        """Take one step; raises ``EpicycleError`` if no step is possible."""
        start = self.end
        self._before = self._piece or self._before
        self._piece = None
        if not self._advance():
            raise EpicycleError(
                f"the solution cannot be continued beyond {start:.9g} s from here: the required step is shorter than "
                "the spacing between numbers"
            )
        if self._guards:
            self._ahead.append((start, self.end, list(range(len(self._guards)))))

    def at(self, time: float) -> State:
        """The state at a time; steps are taken up to there."""
        while self.end < time:
            self.extend()
        if self.end == 0.0 or time <= 0.0:
            return self._start
        piece = self._latest()
        if time < piece.start and self._before is not None:
            piece = self._before
        return piece.at(time)

    def _latest(self) -> Piece | Exact:
        """The solution along the latest step, computed on request because that takes time."""
        if self._piece is None:
            self._piece = self.stepper.piece()
        return self._piece

    # -- steps ----------------------------------------------------------------------------------------------------

    def _advance(self) -> bool:
        """Take one step, which is longer than the window only if nothing hides in it; False if there is none."""
        stepper = self._watched
        if stepper is None:
            return self.stepper.step()
        while True:
            # By its length, a step of one window may seem longer than that: times are rounded.
            before = copy.copy(stepper) if min(stepper.next_step, stepper.limits.max_step) > WINDOW else None
            if not stepper.step():
                return False
            self._taken += 1
            if before is None or self.end - before.time <= WINDOW or not self._hides(before.time):
                break
            # Then it is likely to stay so: a longer step is tried less and less often.
            length = self.end - before.time
            self.stepper = self._watched = stepper = before
            self._piece = None
            _limit(stepper, length / 4.0)
            self._patience, self._taken = min(2 * self._patience, _MAX_PATIENCE), 0
        if self._taken >= self._patience:
            _limit(stepper, stepper.limits.max_step * 4.0)
            self._taken = 0
        return True

    def _hides(self, start: float) -> bool:
        """Whether a derivative may be far from all its values in the latest step.

        These are its values at both ends, also with the states at the corners of their bounds, and the slopes of the
        solution between.  Points within the step do not count: the stepper may have missed what happens there.
        """
        end, piece = self.end, self._latest()
        bounds = piece.bounds(start, end)
        lows, highs = [low for low, _ in bounds], [high for _, high in bounds]
        mixed = [pair[number % 2] for number, pair in enumerate(bounds)]
        quarter = 0.25 * (end - start)
        states = [piece.at(start), *(piece.at(start + number * quarter) for number in (1, 2, 3)), piece.at(end)]
        places = [(start, states[0]), (end, states[4]), (start, lows), (end, highs), (end, mixed)]
        try:
            found = [self._rates(time, state) for time, state in places]
        except EpicycleError:  # a corner may lie where the derivatives are not defined
            return True
        found += [[(new - old) / quarter for old, new in zip(*pair, strict=True)] for pair in pairwise(states)]
        possible = self._bounds(start, end, bounds)
        for (low, high), values in zip(possible, zip(*found, strict=True), strict=True):
            least, most = min(values), max(values)
            margin = 2.0 * (most - least) + _NOISE * max(abs(least), abs(most))
            if not (least - margin <= low and high <= most + margin):
                return True
        return False

    # -- crossings ------------------------------------------------------------------------------------------------

    def search(self, time: float) -> None:
        """Search for the first crossing up to a time, or a little beyond."""
        while self.crossing is None and self.searched < time:
            self.look()

    def look(self) -> None:
        """Search the next part of the solution, taking a step if needed: a window, or more where no guard can cross."""
        if not self._ahead:
            self.extend()
        left, right, numbers = self._ahead.pop()
        bounds = self._latest().bounds(left, right)
        numbers = [number for number in numbers if not self._stays(self._guards[number], left, right, bounds)]
        if numbers and right - left > self._window:
            middle = left + 0.5 * (right - left)
            self._ahead += [(middle, right, numbers), (left, middle, numbers)]
            return
        if numbers:
            width = (right - left) / CELLS
            places = [left + cell * width for cell in range(CELLS)] + [right]
            for start, end in pairwise(places):
                self.crossing = self._cross(start, end, numbers)
                if self.crossing is not None:
                    return
        self.searched = right

    def rewind(self, time: float) -> None:
        """Give guards their sides at a time that the search has passed, where the solution is left."""
        for left, right, guard, side in reversed(self._turns):
            if right > time:
                guard.side = side if left >= time else self._sign(guard, time) or side
        self._turns.clear()

    def _turn(self, guard: Guard, side: int, left: float, right: float) -> None:
        """Set the side of a guard after a part of the search."""
        if guard.side != side:
            self._turns.append((left, right, guard, guard.side))
            guard.side = side

    def _stays(self, guard: Guard, left: float, right: float, bounds: Sequence[Bounds]) -> bool:
        """Whether a guard certainly keeps its side from one time to another."""
        low, high = guard.bounds(left, right, bounds)
        side = 1 if low > 0.0 else -1 if high < 0.0 else 0
        if side == 0 or guard.side == -side:
            return False
        self._turn(guard, side, left, right)
        return True

    def _cross(self, left: float, right: float, numbers: Sequence[int]) -> Crossing | None:
        """The first crossing that counts in a cell."""
        sides = {number: self._side(self._guards[number], left, right) for number in numbers}
        found = {
            number: self._root(self._guards[number], *bracket)
            for number, (_, after, bracket) in sides.items()
            if bracket is not None and self._guards[number].counts(after)
        }
        if not found:
            for number, (_, after, _) in sides.items():
                self._turn(self._guards[number], after, left, right)
            return None
        time, crossed = min(found.values()), {}
        for number, (before, after, _) in sides.items():
            guard = self._guards[number]
            sign = self._sign(guard, time)
            # Rounding may put one of two equal roots slightly after the other: include every guard that has crossed
            # by now.
            if number in found and (found[number] == time or sign == after):
                crossed[number] = after
            elif number not in found:
                self._turn(guard, sign or before, left, right)
        return Crossing(time, crossed)

    def _side(self, guard: Guard, left: float, right: float) -> tuple[int, int, tuple[float, float] | None]:
        """The sides of a guard before and after a cell, and the times between which it crosses, if it does."""
        before, after = guard.side, self._sign(guard, right)
        if before == 0:
            # It starts at zero, as after a bounce. It may go to one side and end on the other within the cell.
            inner = self._excursion(guard, left, right, after)
            return (before, after, None) if inner is None else (-after, after, inner)
        return (before, before, None) if after in (0, before) else (before, after, (left, right))

    def _excursion(self, guard: Guard, left: float, right: float, after: int) -> tuple[float, float] | None:
        """Where a guard that starts at zero and ends on one side was on the other side before."""
        if after == 0:
            return None
        noise = _NOISE * abs(self._value(guard, right))
        far, share = right, 1.0
        for _ in range(_HALVINGS):
            share *= 0.5
            near = left + (right - left) * share
            if -after * self._value(guard, near) > noise:
                return near, far
            far = near
        return None

    def _value(self, guard: Guard, time: float) -> float:
        return guard.value(time, self.at(time))

    def _sign(self, guard: Guard, time: float) -> int:
        return sign_of(self._value(guard, time))

    def _root(self, guard: Guard, left: float, right: float) -> float:
        value = partial(self._value, guard)
        if value(left) == 0.0 or value(left) * value(right) > 0.0:
            return left  # it was at zero already, or beyond by rounding
        return root(value, left, right)


def _limit(stepper: Stepper, longest: float) -> None:
    longest = min(max(longest, WINDOW), LONGEST)
    if longest != stepper.limits.max_step:
        stepper.limits = replace(stepper.limits, max_step=longest)


def root(function: Callable[[float], float], left: float, right: float, least: float = 1e-15) -> float:
    """The zero of a function with different signs at both ends, to the last bits or to ``least``.

    T. R. Chandrupatla, Adv. Eng. Softw. 28 (1997) 145-149: inverse quadratic interpolation where three points allow
    it, bisection elsewhere.
    """
    newest, other = left, right
    at_newest, at_other = function(left), function(right)
    share = 0.5
    for _ in range(_BISECTIONS):
        middle = newest + share * (other - newest)
        at_middle = function(middle)
        if (at_middle > 0.0) == (at_newest > 0.0):
            third, at_third = newest, at_newest
        else:
            third, at_third = other, at_other
            other, at_other = newest, at_newest
        newest, at_newest = middle, at_middle
        best = newest if abs(at_newest) < abs(at_other) else other
        width = abs(other - newest)
        tolerance = 2.0 * _PRECISION * abs(best) + 0.5 * least
        if at_middle == 0.0 or 2.0 * tolerance >= width:
            return middle if at_middle == 0.0 else best
        share = 0.5
        place = (newest - other) / (third - other)
        height = (at_newest - at_other) / (at_third - at_other)
        if height * height < place and (1.0 - height) * (1.0 - height) < 1.0 - place:
            share = at_newest / (at_other - at_newest) * (at_third / (at_other - at_third))
            share += (
                (third - newest) / (other - newest)
                * (at_newest / (at_third - at_newest))
                * (at_other / (at_third - at_other))
            )  # fmt: skip
        least_share = tolerance / width
        share = min(max(share, least_share), 1.0 - least_share)
    return best


def sign_of(value: float) -> int:
    """1, 0 or -1."""
    return (value > 0) - (value < 0)
