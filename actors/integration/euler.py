"""Euler's method with a fixed step: what many published models of controllers are simulated with."""

from __future__ import annotations

from .stepper import Derivative, Limits, Piece, State


class Euler:
    """Steps of equal length, the longest that is allowed, along straight lines; errors are not estimated."""

    def __init__(self, derivative: Derivative, state: State, limits: Limits) -> None:
        self.time = 0.0
        self.next_step = limits.max_step
        self.limits = limits
        self._derivative, self._state = derivative, state
        self._rates = derivative(0.0, state)
        self._latest = 0.0, state, self._rates
        self._steps = 0

    def step(self) -> bool:
        """Take a step; False if it does not move the time."""
        step = self.next_step
        self._latest = self.time, self._state, self._rates
        self._state = [value + step * rate for value, rate in zip(self._state, self._rates, strict=True)]
        self._steps += 1
        self.time = self._steps * step  # no rounding accumulates
        self._rates = self._derivative(self.time, self._state)
        return self.time > self._latest[0]

    def piece(self) -> Piece:
        """The line along the latest step."""
        start, state, rates = self._latest
        return Piece(start, self.time, start, 1.0, [(1.0, 0.0)], [state, rates])
