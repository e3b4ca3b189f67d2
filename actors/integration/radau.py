"""Radau: the implicit Runge-Kutta method Radau IIA of order 5, for stiff systems.

E. Hairer, G. Wanner: Solving Ordinary Differential Equations II, section IV.8.
"""

from __future__ import annotations

import math
from typing import Final

from .newton import Convergence, Factors, Jacobian, Matrix
from .stepper import (
    GROWTH_LIMIT,
    SHRINK_LIMIT,
    Derivative,
    Limits,
    Piece,
    State,
    Stepper,
    added,
    combined,
    norm,
    root_power,
    taken,
)

_MAX_CORRECTIONS: Final = 6
_ROOT: Final = math.sqrt(6.0)
_NODES: Final = ((4.0 - _ROOT) / 10.0, (4.0 + _ROOT) / 10.0, 1.0)
_ERROR: Final = ((-13.0 - 7.0 * _ROOT) / 3.0, (-13.0 + 7.0 * _ROOT) / 3.0, -1.0 / 3.0)
# The inverse of the tableau's matrix has one real eigenvalue and a pair of complex ones,
_REAL: Final = 3.637834252744496
_PAIR: Final = (2.6810828736277523, -3.050430199247411)
# and these matrices transform from its eigenvectors to the stages and back.
_TO_STAGES: Final = (
    (0.09443876248897524, -0.14125529502095421, 0.03002919410514742),
    (0.25021312296533332, 0.20412935229379994, -0.38294211275726192),
    (1.0, 1.0, 0.0),
)
_FROM_STAGES: Final = (
    (4.17871859155190428, 0.32768282076106237, 0.52337644549944951),
    (-4.17871859155190428, -0.32768282076106237, 0.47662355450055044),
    (0.50287263494578682, -2.57192694985560522, 0.59603920482822492),
)
# The rows of the polynomial through the start and the stages, over the stages.
_DENSE: Final = (
    (13.0 / 3.0 + 7.0 * _ROOT / 3.0, 13.0 / 3.0 - 7.0 * _ROOT / 3.0, 1.0 / 3.0),
    (-23.0 / 3.0 - 22.0 * _ROOT / 3.0, -23.0 / 3.0 + 22.0 * _ROOT / 3.0, -8.0 / 3.0),
    (10.0 / 3.0 + 5.0 * _ROOT, 10.0 / 3.0 - 5.0 * _ROOT, 10.0 / 3.0),
)
_FACTORS: Final = [(1.0, 0.0)] * 3

Stages = list[State]  # three, state by state


def _times(matrix: tuple[tuple[float, ...], ...], stages: Stages) -> Stages:
    return [combined(row, stages) for row in matrix]


class Radau(Stepper):
    """Three implicit stages, solved by simplified Newton iterations in the eigenvectors of the tableau."""

    def __init__(self, derivative: Derivative, state: State, limits: Limits) -> None:
        super().__init__(3, derivative, state, limits)
        self._jacobian = Jacobian(derivative, len(state), limits.absolute)
        self._matrix: Matrix = self._jacobian.at(0.0, state, self.rates)
        self._is_new = True  # whether the Jacobian belongs to the present point
        self._factors: tuple[Factors, Factors] | None = None
        self._was_rejected = False  # a longer step from here
        self._before: tuple[float, float] | None = None  # the latest step and its error
        self._piece: Piece | None = None

    def prepare(self, step: float) -> None:
        if step != self.next_step:
            self._before = self._factors = None
        self._was_rejected = False

    def attempt(self, end: float, step: float) -> float | None:
        newton = Convergence(self.limits, _MAX_CORRECTIONS)
        stages = self._solve(newton, step)
        if not newton.is_reached or self._factors is None:
            self._factors = None
            if self._is_new:
                return 0.5
            self._matrix = self._jacobian.at(self.time, self.state, self.rates)
            self._is_new = True
            return 1.0
        safety = 0.9 * (2 * _MAX_CORRECTIONS + 1) / (2 * _MAX_CORRECTIONS + newton.count)
        state = added(self.state, stages[2])
        error = self._error(self._factors[0], stages, state, step)
        factor = safety * self._predicted(step, error)
        if not error <= 1.0:  # also if it is NaN
            self._factors = None
            self._was_rejected = True
            return max(SHRINK_LIMIT, factor)
        self._accept(end, state, stages)
        self._before = step, error
        self._go_on(step, min(GROWTH_LIMIT, factor), newton)
        return None

    def _solve(self, newton: Convergence, step: float) -> Stages:
        """The stages, as increments of the state."""
        stages = [[0.0] * len(self.state)] * 3
        if self._piece is not None:  # the latest polynomial extrapolates for a while
            stages = [taken(self._piece.at(self.time + node * step), self.state) for node in _NODES]
        if self._factors is None:
            self._factors = _factorised(self._matrix, step)
        if self._factors is None:
            return stages
        real, (pair, turn) = _REAL / step, (_PAIR[0] / step, _PAIR[1] / step)
        scale = self.scale(self.state)
        size = len(scale)
        parts = _times(_FROM_STAGES, stages)
        goes_on = True
        while goes_on:
            rates = [
                self.derivative(self.time + node * step, added(self.state, stage))
                for node, stage in zip(_NODES, stages, strict=True)
            ]
            one, two, three = _times(_FROM_STAGES, rates)
            change = self._factors[0].solve([rate - real * part for rate, part in zip(one, parts[0], strict=True)])
            both = self._factors[1].solve(
                [rate - (pair * x - turn * y) for rate, x, y in zip(two, parts[1], parts[2], strict=True)]
                + [rate - (pair * y + turn * x) for rate, x, y in zip(three, parts[1], parts[2], strict=True)]
            )
            goes_on = newton.goes_on(norm([*change, *both], scale * 3))
            parts = list(map(added, parts, (change, both[:size], both[size:])))
            stages = _times(_TO_STAGES, parts)
        return stages

    def _error(self, factors: Factors, stages: Stages, state: State, step: float) -> float:
        ends = [value / step for value in combined(_ERROR, stages)]
        scale = self.scale(self.state, state)
        error = factors.solve(added(self.rates, ends))
        size = norm(error, scale)
        if self._was_rejected and size > 1.0:
            # The error of stiff components is exaggerated: a second pass through the system damps it.
            rates = self.derivative(self.time, added(self.state, error))
            size = norm(factors.solve(added(rates, ends)), scale)
        return size

    def _predicted(self, step: float, error: float) -> float:
        """The factor by which the step may change for an error of 1, from the latest two errors (Gustafsson)."""
        if error == 0.0:
            return math.inf
        root = root_power(error, 0.25)
        if self._before is None:
            return 1.0 / root
        before, error_before = self._before
        return min(1.0, step / before * root_power(error_before, 0.25) / root) / root

    def _accept(self, end: float, state: State, stages: Stages) -> None:
        rows = [self.state, *_times(_DENSE, stages)]
        self._piece = Piece(self.time, end, self.time, end - self.time, _FACTORS, rows)
        self.time, self.state, self.rates = end, state, self.derivative(end, state)

    def _go_on(self, step: float, factor: float, newton: Convergence) -> None:
        """Prepare the next step; the factorisation is kept while the step would hardly be longer."""
        self._is_new = newton.count > 2 and newton.rate > 1e-3
        if self._is_new:
            self._matrix = self._jacobian.at(self.time, self.state, self.rates)
        elif factor < 1.2:
            self.next_step = step
            return
        self._factors = None
        self.next_step = step * factor

    def piece(self) -> Piece:
        assert self._piece is not None
        return self._piece


def _factorised(matrix: Matrix, step: float) -> tuple[Factors, Factors] | None:
    """The systems of the real eigenvalue and of the pair, the latter twice as large in real numbers; None if
    singular."""
    real, (pair, turn) = _REAL / step, (_PAIR[0] / step, _PAIR[1] / step)
    single = [[-value for value in row] for row in matrix]
    upper = [[*row, *([0.0] * len(row))] for row in single]
    lower = [[*([0.0] * len(row)), *row] for row in single]
    size = len(single)
    for number in range(size):
        single[number][number] += real
        upper[number][number] += pair
        upper[number][size + number] = -turn
        lower[number][number] = turn
        lower[number][size + number] += pair
    try:
        return Factors(single), Factors(upper + lower)
    except ZeroDivisionError:
        return None
