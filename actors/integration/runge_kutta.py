"""Explicit embedded Runge-Kutta methods, each described by its tableau."""

from __future__ import annotations

import math
from collections.abc import Iterable

from .stepper import GROWTH_LIMIT, SHRINK_LIMIT, Derivative, Limits, Piece, State, Stepper, combined, norm, stretch
from .tableaux import Stage, Tableau, Weights

_SAFETY = 0.9


class RungeKutta(Stepper):
    """The explicit method of a tableau; its polynomial along a step is computed only if somebody asks for it."""

    def __init__(self, tableau: Tableau, derivative: Derivative, state: State, limits: Limits) -> None:
        super().__init__(tableau.order, derivative, state, limits)
        self._tableau = tableau
        self._begin: tuple[float, State] = 0.0, state
        self._latest = [self.rates]  # the derivatives at the stages of the latest step

    def step(self) -> bool:
        least = self.least_step
        step = min(max(self.next_step, least), self.limits.max_step)
        longest = GROWTH_LIMIT
        while step >= least:
            end = self.time + step
            step = end - self.time
            rates = [self.rates]
            state = self._pass(self._tableau.stages, (self.time, self.state), step, rates)
            error = self._error(rates, step, self.scale(self.state, state))
            if error < 1.0:
                self._begin, self._latest = (self.time, self.state), rates
                self.time, self.state, self.rates = end, state, rates[-1]
                self.next_step = step * min(stretch(error, _SAFETY, self._tableau.order), longest)
                return True
            step *= max(SHRINK_LIMIT, stretch(error, _SAFETY, self._tableau.order))  # NaN shrinks it, too
            longest = 1.0
        return False

    def _pass(self, stages: Iterable[Stage], begin: tuple[float, State], step: float, rates: list[State]) -> State:
        """Take derivatives at stages, and add them to ``rates``; returns the state at the last one."""
        time, start = begin
        state = start
        for share, weights in stages:
            state = [value + step * change for value, change in zip(start, _weighted(weights, rates), strict=True)]
            rates.append(self.derivative(time + share * step, state))
        return state

    def _error(self, rates: list[State], step: float, scale: list[float]) -> float:
        errors = [norm(_weighted(weights, rates), scale) for weights in self._tableau.errors]
        if len(errors) == 1 or errors[0] == 0.0:
            return step * errors[0]
        high, low = errors
        return step * high * high / math.sqrt(high * high + 0.01 * low * low)

    def piece(self) -> Piece:
        start, state = self._begin
        step, rates = self.time - start, list(self._latest)
        self._pass(self._tableau.extra, self._begin, step, rates)
        rows = [[step * value for value in _weighted(weights, rates)] for weights in self._tableau.dense]
        return Piece(start, self.time, start, step, self._tableau.factors, [state, *rows])


def _weighted(weights: Weights, rates: list[State]) -> State:
    """The weighted sum of the derivatives at some stages."""
    return combined([weight for _, weight in weights], [rates[stage] for stage, _ in weights])
