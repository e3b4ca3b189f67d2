"""Exact: systems in which each state goes its own way along a line or an exponential."""

from __future__ import annotations

import math
from typing import Final

from ..core.elementary import expm1
from .stepper import Bounds, State

_STEP: Final = 1e6  # s
_LEAST: Final = 1e-200  # 1/s; below it an exponential is a line


class Exact:
    """The solution of ``dx/dt = rate + pull * x`` for each state; stepper and piece at once.

    Raises ``OverflowError`` if a value at the start is too large.
    """

    def __init__(self, state: State, rates: list[float], pulls: list[float]) -> None:
        self.start = self.time = 0.0
        self._state, self._pulls = state, pulls
        self._speeds = [rate + pull * value for rate, pull, value in zip(rates, pulls, state, strict=True)]
        if not all(map(math.isfinite, self._speeds)):
            raise OverflowError

    def step(self) -> bool:
        """Extend the solution, by less where it leaves the range of numbers; False where that begins."""
        step, least = _STEP, math.ulp(self.time)
        while step > least:
            end = self.time + step
            if self._reaches(end):
                self.time = end
                return True
            step *= 0.5
        return False

    def _reaches(self, time: float) -> bool:
        try:
            return all(map(math.isfinite, self.at(time)))
        except OverflowError:
            return False

    def piece(self) -> Exact:
        """The solution, which is the same everywhere."""
        return self

    def at(self, time: float) -> State:
        """The states at a given time."""
        return [
            value + speed * (expm1(pull * time) / pull if abs(pull) > _LEAST else time) if speed else value
            for value, speed, pull in zip(self._state, self._speeds, self._pulls, strict=True)
        ]

    def bounds(self, left: float, right: float) -> list[Bounds]:
        """Bounds on each state between two times: a state never turns round."""
        pairs = zip(self.at(left), self.at(right), strict=True)
        return [(one, other) if one < other else (other, one) for one, other in pairs]
