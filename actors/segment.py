"""Segment: the solution of an ODE from one discontinuity on, and where guard functions cross zero along it.

SciPy's solvers, the ones behind ``solve_ivp``, are stepped by hand, so that no end time is needed and the steps, and
with them every digit, do not depend on when somebody looks at the solution.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from .core import EpicycleError

METHODS: Final = ("RK45", "RK23", "DOP853", "Radau", "BDF")
CELLS: Final = 8  # a step is searched for changes of sign in so many parts
_HALVINGS: Final = 12
_NOISE: Final = 1e-11  # what counts as zero beside the value at the far end of a cell

State = NDArray[np.float64]
Function = Callable[[float, State], Any]


@dataclass
class Guard:
    """A function whose zero crossings count; ``side`` is the sign that it had last, 0 where that is open."""

    value: Callable[[float, State], float]
    rising: bool
    falling: bool
    side: int = 0

    def counts(self, side: int) -> bool:
        """Whether a crossing to this side counts."""
        return self.rising if side > 0 else self.falling


@dataclass(frozen=True)
class Crossing:
    """Where guards cross zero first: the time, and for each that does, its number and the side it crosses to."""

    time: float
    sides: dict[int, int]


def _no_warnings() -> np.errstate:
    """What overflows fails, and is told then: a step that cannot be taken, or a derivative that is no number."""
    return np.errstate(over="ignore", invalid="ignore", divide="ignore")


class Segment:
    """A solution that starts at time 0 and is extended as far as it is asked for, or to the first crossing."""

    def __init__(
        self,
        derivative: Function,
        state: State,
        guards: Sequence[Guard],
        *,
        method: str,
        tolerance: tuple[float, float],
        max_step: float,
    ) -> None:
        import scipy.integrate

        relative, absolute = tolerance
        with _no_warnings():
            self._solver = getattr(scipy.integrate, method)(
                derivative, 0.0, state, np.inf, rtol=relative, atol=absolute, max_step=max_step
            )
        self._guards = guards
        self._start = state
        self._piece: Any = None
        self._before: Any = None  # the piece before: a look at the past may reach back by a fraction of a nanosecond
        self.crossing: Crossing | None = None

    @property
    def end(self) -> float:
        """How far the solution is known."""
        return float(self._solver.t)

    def extend(self) -> None:
        """Take one step; raises ``EpicycleError`` if there is none to take."""
        with _no_warnings():
            message = self._solver.step()
        if self._solver.status == "failed":
            raise EpicycleError(f"the solution cannot be continued beyond {self.end:.9g} s from here: {message}")
        self._before, self._piece = self._piece, self._solver.dense_output()
        if self.crossing is None:
            self._search(float(self._solver.t_old), self.end)

    def at(self, time: float) -> State:
        """The state at a time; steps are taken up to there."""
        while self.end < time:
            self.extend()
        if self._piece is None or time <= 0.0:
            return self._start
        piece = self._piece if time >= self._piece.t_min or self._before is None else self._before
        result: State = piece(time)
        return result

    # -- crossings ------------------------------------------------------------------------------------------------

    def _search(self, start: float, end: float) -> None:
        """Look for the first crossing that counts in the latest step."""
        places = np.linspace(start, end, CELLS + 1)
        for left, right in zip(places[:-1].tolist(), places[1:].tolist(), strict=True):
            sides = [self._side(guard, left, right) for guard in self._guards]
            found = {
                number: self._root(guard, *bracket)
                for number, (guard, (_, after, bracket)) in enumerate(zip(self._guards, sides, strict=True))
                if bracket is not None and guard.counts(after)
            }
            if found:
                self.crossing = self._first(found, sides)
                return
            for guard, (_, after, _) in zip(self._guards, sides, strict=True):
                guard.side = after

    def _first(self, found: dict[int, float], sides: list[Any]) -> Crossing:
        """The first of the crossings in a cell, and every guard on its side up to then."""
        time = min(found.values())
        crossed = {}
        for number, (guard, (before, after, _)) in enumerate(zip(self._guards, sides, strict=True)):
            sign = self._sign(guard, time)
            # Rounding may put one of two equal roots a hair behind the other: what has crossed by now is here, too.
            if number in found and (found[number] == time or sign == after):
                crossed[number] = after
            elif number not in found:
                guard.side = sign or before
        return Crossing(time, crossed)

    def _side(self, guard: Guard, left: float, right: float) -> tuple[int, int, tuple[float, float] | None]:
        """The side of a guard before and after a cell, and between which times it crosses, if it does."""
        before, after = guard.side, self._sign(guard, right)
        if before == 0:
            # It starts at zero, as after a bounce. It may go to one side and be back on the other within the cell.
            inner = self._excursion(guard, left, right, after)
            if inner is None:
                return before, after, None
            return -after, after, inner
        if after in (0, before):
            return before, before, None
        return before, after, (left, right)

    def _excursion(self, guard: Guard, left: float, right: float, after: int) -> tuple[float, float] | None:
        """Where a guard that starts at zero and ends on a side has been on the other one before."""
        if after == 0:
            return None
        noise = _NOISE * abs(guard.value(right, self.at(right)))
        far = right
        for halving in range(1, _HALVINGS + 1):
            near = left + (right - left) * 0.5**halving
            if -after * guard.value(near, self.at(near)) > noise:
                return near, far
            far = near
        return None

    def _sign(self, guard: Guard, time: float) -> int:
        value = guard.value(time, self.at(time))
        return (value > 0) - (value < 0)

    def _root(self, guard: Guard, left: float, right: float) -> float:
        from scipy.optimize import brentq

        def value(time: float) -> float:
            return guard.value(time, self.at(time))

        if value(left) == 0.0 or value(left) * value(right) > 0.0:
            return left  # it was at zero already, or beyond by rounding
        return float(brentq(value, left, right, xtol=1e-15, rtol=4 * np.finfo(float).eps))
