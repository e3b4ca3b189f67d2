"""Linear systems driven by tokens: StateSpace and TransferFunction."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterable
from itertools import dropwhile
from typing import Any, Final

import numpy as np

from ..core import (
    REQUIRED,
    Actor,
    EpicycleError,
    InputPort,
    OutputPort,
    Parameter,
    ParameterError,
    array_parameter,
    brief,
    counted,
    shaped,
    to_seconds,
)
from ..core.elementary import total
from ..readings import finite_numbers
from .matrices import Exponential, Matrix, Vector, applied

_LARGEST: Final = 100  # states and inputs of one system; at this limit, its exponential takes a second
_KEPT: Final = 64  # solutions for times between events, mostly the same few times


class _LinearSystem(Actor):
    """The common part: x' = A x + B u, y = C x + D u from event to event, or from step to step."""

    input: InputPort[Any] = InputPort(doc="u, held between tokens: a number, or an array of several")
    trigger = InputPort(doc="requests the output; with 'sampled', it also makes a step")
    output: OutputPort[Any] = OutputPort(
        depends_on=("trigger",),
        doc="y at the time of each trigger: a number, or an array; where u acts on y directly (d), it depends on "
        "'input' within the same tag",
    )

    sampled = Parameter(
        bool, False, doc="whether it makes a step at each trigger, x[k+1] = A x[k] + B u[k], instead of following time"
    )

    @abstractmethod
    def _matrices(self) -> tuple[Matrix, Matrix, Matrix, Matrix]:
        """A, B, C and D; raises ``ParameterError`` if they are invalid."""

    @abstractmethod
    def _start(self) -> tuple[Vector, Vector]:
        """The state at the start, and the input before its first token."""

    def check(self) -> None:
        self._a, self._b, self._c, self._d = self._matrices()
        self._width = len(self._d[0])
        self.input.type, self.output.type = _type(self._width), _type(len(self._d))
        self.output.depends_on = None if any(map(any, self._d)) else ("trigger",)
        self._start()
        if not self.sampled:
            # C. F. Van Loan, Computing Integrals Involving the Matrix Exponential, IEEE Trans. Automat. Contr. 23
            # (1978): the exponential of [A B; 0 0] also contains the effect of a constant input.
            if len(self._a) + self._width > _LARGEST:
                raise ParameterError(
                    f"{counted(len(self._a), 'state')} and {counted(self._width, 'input')} are more than {_LARGEST} "
                    f"in total, and the matrix exponential would take long; use several systems, or 'sampled' ones"
                )
            whole = [[*row, *more] for row, more in zip(self._a, self._b, strict=True)]
            self._growth = Exponential([*whole, *([[0.0] * (len(whole) + self._width)] * self._width)])

    def initialize(self) -> None:
        self._state, self._held = self._start()
        self._used = self._held  # the input of the present step
        self._since: int | None = None if self.sampled else self.tag.time
        self._known: dict[int, Matrix] = {}

    def fire(self) -> None:
        now = self.tag.time
        asked = self.trigger.present
        if asked and self.sampled:
            if self._since is not None:
                self._state = self._step()
            self._since, self._used = now, self._held
        if self.input.present:
            self._take(finite_numbers(self.input, self.input.value, self._width), now)
        if asked:
            state = self._state if self.sampled else self._at(now)
            given = self._used if self.sampled else self._held
            direct = applied(self._d, given)
            found = [one + two for one, two in zip(applied(self._c, state), direct, strict=True)]
            self.output.send(found[0] if len(found) == 1 else _read_only(found))

    def _take(self, given: Vector, now: int) -> None:
        """Let an input act from now on."""
        if self.sampled:
            self._used = given if self._since == now else self._used
        elif given != self._held:  # the same value again does not change the solution
            self._state, self._since = self._at(now), now
        self._held = given

    def _at(self, now: int) -> Vector:
        """The state now, computed from where the input last changed: requests leave no trace."""
        assert self._since is not None
        elapsed = now - self._since
        if elapsed == 0:
            return self._state
        change = self._known.get(elapsed)
        if change is None:
            if len(self._known) >= _KEPT:
                self._known.clear()
            change = self._known[elapsed] = self._growth.less_one(to_seconds(elapsed))
        moved = applied(change[: len(self._state)], [*self._state, *self._held])
        return self._bounded([one + two for one, two in zip(self._state, moved, strict=True)])

    def _step(self) -> Vector:
        free, driven = applied(self._a, self._state), applied(self._b, self._used)
        return self._bounded([one + two for one, two in zip(free, driven, strict=True)])

    def _bounded(self, state: Vector) -> Vector:
        if all(map(math.isfinite, state)):
            return state
        raise EpicycleError("the state has grown too large for a float: the system is unstable; end the run earlier")


def _read_only(numbers: Vector) -> Any:
    array = np.array(numbers)
    array.setflags(write=False)
    return array


def _type(width: int) -> Any:
    return float if width == 1 else shaped(np.ndarray, (width,))


class _MatrixParameter(Parameter[Any]):
    """Rows of numbers, all of the same length."""

    def __init__(self, default: Any = REQUIRED, *, doc: str) -> None:
        super().__init__(float, default, shape=(None, None), doc=doc)

    def convert(self, value: object) -> Any:
        if isinstance(value, (list, tuple)):
            lengths = {len(row) if isinstance(row, (list, tuple, np.ndarray)) else -1 for row in value}
            if len(lengths) > 1 and -1 not in lengths:
                raise ParameterError(f"{brief(value)} is not a matrix: its rows differ in length")
        return super().convert(value)


class StateSpace(_LinearSystem):
    """A linear system in state space, ``dx/dt = A x + B u``, ``y = C x + D u``.

    A mass on a spring, with its position as output:

        mass: {type: StateSpace, a: [[0, 1], [-4, -0.4]], b: [[0], [1]], c: [[1, 0]], initial: [1, 0]}

    The input holds its value between tokens, so the solution is exact: it is computed by the matrix exponential from
    where the input last changed.  It does not depend on when it is requested, and has the same bits on every processor.
    Numbers have no units: the model chooses them; time is in s.

    Without D, the output does not depend on the input within the same tag, so the actor may be part of a loop without
    delay.  With ``sampled``, it makes a step at each trigger: ``x[k+1] = A x[k] + B u[k]``, with the input at the time
    of the trigger.  Ptolemy: ``LinearStateSpace``, and with ``sampled`` ``LinearDifferenceEquationSystem``.
    """

    a = _MatrixParameter(doc="A, n x n")
    b = _MatrixParameter(doc="B, n x m: a column for each input")
    c = _MatrixParameter(None, doc="C, p x n: a row for each output; all states if left out")
    d = _MatrixParameter(None, doc="D, p x m; 0 if left out")
    initial = array_parameter((None,), None, doc="x at the start; 0 if left out")
    held = array_parameter((None,), None, doc="u before its first token; 0 if left out")

    def _matrices(self) -> tuple[Matrix, Matrix, Matrix, Matrix]:
        a, b = _rows("a", self.a), _rows("b", self.b)
        size = len(a)
        _check_shape("a", a, (size, size), "it must be square")
        width = len(b[0]) if b else 0
        _check_shape("b", b, (size, max(width, 1)), f"a row for each of {counted(size, 'state')}")
        c = [[float(i == j) for j in range(size)] for i in range(size)] if self.c is None else _rows("c", self.c)
        _check_shape("c", c, (max(len(c), 1), size), f"a column for each of {counted(size, 'state')}")
        d = [[0.0] * width for _ in c] if self.d is None else _rows("d", self.d)
        _check_shape("d", d, (len(c), width), "a row for each output and a column for each input")
        return a, b, c, d

    def _start(self) -> tuple[Vector, Vector]:
        return (
            _vector("initial", self.initial, len(self._a), "state"),
            _vector("held", self.held, len(self._d[0]), "input"),
        )


class TransferFunction(_LinearSystem):
    """A linear system with one input and one output, given by its transfer function, such as ``2 / (s^2 + 0.4 s + 4)``.

        plant: {type: TransferFunction, numerator: [2], denominator: [1, 0.4, 4]}

    Coefficients are those of descending powers of s, or of z with ``sampled``.  The solution is exact, as described for
    ``StateSpace``.  ``initial`` holds the output and its derivatives at the start (with ``sampled``, the output and its
    values at the next steps) for zero input.  Where the numerator has fewer coefficients than the denominator, the
    output does not depend on the input within the same tag, so the actor may be part of a loop without delay.  For a
    dead time, give the connection a ``delay:``.

    The states are those of the observable canonical form (T. Kailath, Linear Systems, 1980, section 2.1).
    Ptolemy: ``ContinuousTransferFunction``.
    """

    numerator = array_parameter((None,), (1.0,), doc="coefficients of the numerator, highest power first")
    denominator = array_parameter((None,), doc="coefficients of the denominator, highest power first")
    initial = array_parameter((None,), (), doc="the output and its derivatives at the start; those left out are 0")
    held = Parameter(float, 0.0, doc="the input before its first token")

    def _matrices(self) -> tuple[Matrix, Matrix, Matrix, Matrix]:
        above, below = polynomials(self.numerator, self.denominator)
        if len(above) > len(below):
            raise ParameterError(
                f"numerator: its degree {len(above) - 1} is above that of the denominator, {len(below) - 1}: the "
                f"system would differentiate its input, which jumps"
            )
        above = [0.0] * (len(below) - len(above)) + above
        order, direct = len(below) - 1, above[0]
        shift = [[float(j == i + 1) for j in range(order)] for i in range(order)]
        a = [[-factor, *row[1:]] for factor, row in zip(below[1:], shift, strict=True)]
        b = [[over - factor * direct] for over, factor in zip(above[1:], below[1:], strict=True)]
        return a, b, [[float(i == 0) for i in range(order)]], [[direct]]

    def _start(self) -> tuple[Vector, Vector]:
        order, given = len(self._a), _row("initial", self.initial)
        if len(given) > order:
            raise ParameterError(
                f"initial: {counted(len(given), 'value')}, expected at most {order}, the order of the system"
            )
        given += [0.0] * (order - len(given))
        below = [1.0, *(-row[0] for row in self._a)]
        # y and its derivatives are x1, x2 - a1 x1, ..., so x2 is y' + a1 y, and so on.
        state = [total(below[j] * given[i - j] for j in range(i + 1)) for i in range(order)]
        return state, _row("held", [self.held])


def polynomials(numerator: Any, denominator: Any) -> tuple[Vector, Vector]:
    """The coefficients divided by the leading one of the denominator; the numerator without leading zeros."""
    below = _row("denominator", denominator)
    if not below or below[0] == 0.0:
        raise ParameterError("denominator: the first coefficient, that of the highest power, must not be 0 or missing")
    above = list(dropwhile(lambda each: each == 0.0, _row("numerator", numerator)))
    return [each / below[0] for each in above], [each / below[0] for each in below]


def _row(name: str, values: Iterable[float]) -> Vector:
    row = [float(each) for each in values]
    if not all(map(math.isfinite, row)):
        raise ParameterError(f"{name}: the numbers {row} are not all finite")
    return row


def _rows(name: str, values: Any) -> Matrix:
    return [_row(name, row) for row in values.tolist()]


def _check_shape(name: str, rows: Matrix, shape: tuple[int, int], wanted: str) -> None:
    lengths = {len(row) for row in rows} or {0}
    if len(rows) != shape[0] or lengths != {shape[1]}:
        raise ParameterError(f"{name}: {len(rows)} x {max(lengths)}, expected {shape[0]} x {shape[1]}: {wanted}")


def _vector(name: str, values: Any, length: int, noun: str) -> Vector:
    row = [0.0] * length if values is None else _row(name, values.tolist())
    if len(row) != length:
        raise ParameterError(f"{name}: {counted(len(row), 'number')} for {counted(length, noun)}")
    return row
