"""BDF: backward differentiation formulas of order 1 to 5 with quasi-constant steps, for stiff systems.

L. F. Shampine, M. W. Reichelt: The MATLAB ODE suite, SIAM J. Sci. Comput. 18 (1997) 1-22, with the modified
differentiation formulas (NDF) given there.
"""

from __future__ import annotations

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
    dot,
    norm,
    stretch,
    taken,
)

_MAX_ORDER: Final = 5
_MAX_CORRECTIONS: Final = 4
_KAPPA: Final = (0.0, -0.1850, -1 / 9, -0.0823, -0.0415, 0.0)
_GAMMA: Final = (0.0, 1.0, 3 / 2, 11 / 6, 25 / 12, 137 / 60)  # sums of 1/k
_ALPHA: Final = tuple((1.0 - kappa) * gamma for kappa, gamma in zip(_KAPPA, _GAMMA, strict=True))
_ERROR: Final = tuple(
    kappa * gamma + 1.0 / (order + 1) for order, (kappa, gamma) in enumerate(zip(_KAPPA, _GAMMA, strict=True))
)
_FACTORS: Final = [(1.0 / (number + 1), number / (number + 1)) for number in range(_MAX_ORDER)]


class BDF(Stepper):
    """Backward differences of the states, as many as the order, carried from step to step."""

    def __init__(self, derivative: Derivative, state: State, limits: Limits) -> None:
        super().__init__(1, derivative, state, limits)
        self._order = 1
        self._equal_steps = 0
        self._start = 0.0
        zero = [0.0] * len(state)
        self._differences = [state, [self.next_step * rate for rate in self.rates]] + [zero] * (_MAX_ORDER + 1)
        self._jacobian = Jacobian(derivative, len(state), limits.absolute)
        self._matrix: Matrix = self._jacobian.at(0.0, state, self.rates)
        self._is_new = False  # whether it belongs to the present step
        self._factors: Factors | None = None

    def prepare(self, step: float) -> None:
        self._differences = list(self._differences)  # a copy of this stepper keeps its own
        if step != self.next_step:
            self._rescale(step / self.next_step if self.next_step else 1.0)
        self._is_new = False

    def attempt(self, end: float, step: float) -> float | None:
        predicted = combined([1.0] * (self._order + 1), self._differences[: self._order + 1])
        newton = Convergence(self.limits, _MAX_CORRECTIONS)
        correction = self._correct(newton, end, step, predicted)
        if not newton.is_reached:
            self._factors = None
            if self._is_new:
                self._rescale(0.5)
                return 0.5
            self._matrix = self._jacobian.at(end, predicted, self.derivative(end, predicted))
            self._is_new = True
            return 1.0
        safety = 0.9 * (2 * _MAX_CORRECTIONS + 1) / (2 * _MAX_CORRECTIONS + newton.count)
        state = added(predicted, correction)
        scale = self.scale(state)
        error = _ERROR[self._order] * norm(correction, scale)
        if not error <= 1.0:  # also if it is NaN
            factor = max(SHRINK_LIMIT, stretch(error, safety, self._order))
            self._rescale(factor)
            return factor
        self._start, self.time, self.state, self.next_step = self.time, end, state, step
        self._accept(correction)
        if self._equal_steps > self._order:
            self._choose_order(scale, error, safety)
        return None

    def _correct(self, newton: Convergence, end: float, step: float, predicted: State) -> State:
        """Solve for the correction of the predicted state."""
        share = step / _ALPHA[self._order]
        if self._factors is None:
            self._factors = _factorised(self._matrix, share)
        past = combined(_GAMMA[1 : self._order + 1], self._differences[1 : self._order + 1])
        past = [value / _ALPHA[self._order] for value in past]
        scale = self.scale(predicted)
        state, correction = predicted, [0.0] * len(predicted)
        while self._factors is not None:
            rates = self.derivative(end, state)
            left = [share * rate - old - total for rate, old, total in zip(rates, past, correction, strict=True)]
            change = self._factors.solve(left)
            goes_on = newton.goes_on(norm(change, scale))
            correction = added(correction, change)
            if not goes_on:
                break
            state = added(state, change)
        return correction

    def _accept(self, correction: State) -> None:
        """Advance the differences by a step: to each, the one above it is added."""
        differences, order = self._differences, self._order
        differences[order + 2] = taken(correction, differences[order + 1])
        differences[order + 1] = correction
        for number in range(order, -1, -1):
            differences[number] = added(differences[number], differences[number + 1])
        self._equal_steps += 1

    def _choose_order(self, scale: list[float], error: float, safety: float) -> None:
        """Continue with the order, out of this one and its neighbours, that allows the longest step."""
        order = self._order
        best, best_factor = order, stretch(error, 1.0, order)
        for other in (order - 1, order + 1):
            if 1 <= other <= _MAX_ORDER:
                factor = stretch(_ERROR[other] * norm(self._differences[other + 1], scale), 1.0, other)
                if factor > best_factor or (factor == best_factor and other < order):
                    best, best_factor = other, factor
        self._order = best
        factor = min(GROWTH_LIMIT, safety * best_factor)
        self._rescale(factor)
        self.next_step *= factor
        self._factors = None

    def _rescale(self, factor: float) -> None:
        """Turn the differences into those of a step that is longer or shorter by a factor."""
        size = self._order + 1
        new, old = _spread(size, factor), _spread(size, 1.0)
        both = [[dot(row, column) for column in zip(*old, strict=True)] for row in new]
        differences = self._differences[:size]
        self._differences[:size] = [combined(weights, differences) for weights in zip(*both, strict=True)]
        self._equal_steps = 0

    def piece(self) -> Piece:
        rows = self._differences[: self._order + 1]
        return Piece(self._start, self.time, self.time, self.next_step, _FACTORS[: self._order], rows)


def _spread(size: int, factor: float) -> Matrix:
    """The matrix from backward differences to values at points ``factor`` steps apart."""
    rows = [[1.0] * size]
    for number in range(1, size):
        step = [0.0, *((number - 1 - factor * column) / number for column in range(1, size))]
        rows.append([above * each for above, each in zip(rows[-1], step, strict=True)])
    return rows


def _factorised(matrix: Matrix, share: float) -> Factors | None:
    """The identity minus a multiple of a matrix, factorised; None if it is singular."""
    rows = [[-share * value for value in row] for row in matrix]
    for number, row in enumerate(rows):
        row[number] += 1.0
    try:
        return Factors(rows)
    except ZeroDivisionError:
        return None
