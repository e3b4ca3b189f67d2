"""Trajectory: the development of named states in model time, by formulas, from one discontinuity to the next."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence, Set
from functools import lru_cache, partial
from typing import Any, Final

from .core import NANOSECONDS_PER_SECOND, EpicycleError
from .expression import Formula
from .expression.affine import REST, factors_of
from .expression.enclosure import bounds_of
from .expression.translation import KNOWN, UNDECIDED, all_translated
from .expression.values import CONSTANTS
from .integration import Bounds, Exact, RungeKutta, State, Tableau, Unrolled, unrolled
from .solution import Guard, Solution, sign_of

_MAX_STEPS: Final = 10_000
_EXACT: Final = 2**31  # whole numbers up to here give the same as floats in what a float can hold
_AHEAD: Final = 64  # parts of a step that are searched for crossings at once


class Trajectory:
    """The present solution for some states, whose ``rates`` are formulas over them, over ``held`` values and ``time``.

    ``begin`` starts a solution; a further ``begin``, after a change, keeps the same guards.  ``held`` is shared:
    changes in it take effect at the next ``begin``.  ``also`` are names for the time since moments (ns), which are in
    ``since`` before that.
    """

    def __init__(
        self, rates: Mapping[str, Formula], held: dict[str, Any], also: Sequence[str] = (), **solver: Any
    ) -> None:
        self.names = tuple(rates)
        self.guards: list[Guard] = []
        self._watched: list[tuple[Formula, str]] = []  # what they are of
        self.time, self.fraction = 0, 0.0
        self.solution: Solution
        self._formulas = dict(rates)
        self._held = held
        self.since = dict.fromkeys(also, 0)
        moving = frozenset(("time", *self.since, *self.names))
        self._factors = {name: factors_of(formula.source, moving) for name, formula in rates.items()}
        named = {each for formula in rates.values() for each in formula.names} | CONSTANTS.keys()
        self._named = named - {"time", *self.since, *self.names}  # what the rates may use of what is held
        self._solver = solver
        self._function: Callable[..., Any] | None = None  # of time, the other times, the states and what is held
        self._fixed: list[Any] = []  # of what is held, what the rates may use

    def watch(self, formula: Formula, what: str, *, rising: bool = True, falling: bool = True) -> Guard:
        """Search for the zero crossings of a formula, called ``what`` in messages."""

        def value(at: float, state: State) -> float:
            return number_of(formula, self.values(at, state), what)

        guard = Guard(value, partial(self._bounds, formula), rising, falling)
        self.guards.append(guard)
        self._watched.append((formula, what))
        return guard

    def begin(self, time: int, fraction: float, state: State) -> None:
        """Start a solution at ``time`` ns plus a fraction of a nanosecond in s, so that no rounding accumulates over
        crossings."""
        self.time, self.fraction = time, fraction
        self._function, exact = None, self._exact(state)
        texts = self._translate(state) if exact is None else ()
        self.solution = Solution(self._rates, self._bounds_of_rates, state, self.guards, **self._solver, exact=exact)
        if texts and isinstance(stepper := self.solution.stepper, RungeKutta):
            since = 0, *self.since.values()
            if (functions := _unrolled(stepper.tableau, texts, len(since), len(self._fixed))) is not None:
                origins = [(self.time - each) / NANOSECONDS_PER_SECOND for each in since]
                stepper.unroll(Unrolled(*functions, (self.fraction, origins, self._fixed)))

    def _translate(self, state: State) -> tuple[str, ...]:
        """Make a function of the derivatives, if all that they use are floats; returns their texts."""
        used = [name for name in self._held if name in self._named]
        self._fixed = [
            float(value) if type(value) is int and abs(value) <= _EXACT else value
            for value in map(self._held.__getitem__, used)
        ]
        if not all(type(value) is float for value in (*state, *self._fixed)):
            return ()
        sources = tuple(formula.source for formula in self._formulas.values())
        found = all_translated(sources, ("time", *self.since, *self.names, *used))
        self._function, texts = found or (None, ())
        return texts

    def _exact(self, state: State) -> Exact | None:
        """The solution, if every derivative is linear in its own state and depends on nothing else that moves."""
        rates, pulls = [], []
        for name, factors in self._factors.items():
            if factors is None or not factors.keys() <= {REST, name}:
                return None
            try:
                rest, factor = (
                    number_of(factors[each], self._held) if each in factors else 0.0 for each in (REST, name)
                )
            except EpicycleError:  # the derivative itself says what is wrong
                return None
            rates.append(rest)
            pulls.append(factor)
        try:
            return Exact(state, rates, pulls)
        except OverflowError:
            return None

    def begin_at(self, at: float, state: State) -> None:
        """Start again at a time of the present solution."""
        moment = self.moment(at)
        self.begin(moment, self.fraction + at - (moment - self.time) / NANOSECONDS_PER_SECOND, state)

    # -- time -----------------------------------------------------------------------------------------------------

    def elapsed(self, time: int) -> float:
        """Seconds since the start of the solution, which may be later by a fraction of a nanosecond."""
        return max(0.0, (time - self.time) / NANOSECONDS_PER_SECOND - self.fraction)

    def moment(self, at: float) -> int:
        """The nanosecond nearest to a time of the present solution."""
        return self.time + round((self.fraction + at) * NANOSECONDS_PER_SECOND)

    def _at(self, at: float, since: int = 0) -> float:
        """The model time at a time of the present solution, counted from a moment."""
        return (self.time - since) / NANOSECONDS_PER_SECOND + (self.fraction + at)

    def next_look(self, time: int) -> int:
        """When (ns) to check again: at the next crossing or, while none is in sight, where the search for it ends."""
        solution, parts = self.solution, 0
        while solution.crossing is None and self.moment(solution.searched) <= time:
            solution.look()
            parts += 1
            if parts > _MAX_STEPS:
                raise EpicycleError(f"the solver took more than {_MAX_STEPS:,} steps within a nanosecond")
        if parts:
            while solution.crossing is None and solution.searched < solution.end and parts < _AHEAD:
                solution.look()
                parts += 1
        return self.moment(solution.searched if solution.crossing is None else solution.crossing.time)

    # -- values ---------------------------------------------------------------------------------------------------

    def values(self, at: float, state: State) -> dict[str, Any]:
        """The names that expressions can use at a time of the present solution, with their values."""
        names = {**self._held, **dict(zip(self.names, state, strict=True))}
        names["time"] = self._at(at)
        for name, since in self.since.items():
            names[name] = self._at(at, since)
        return names

    def signs(self, at: float, state: State, changing: Set[str] | None = None) -> list[int]:
        """The sides of the guards; 0 for those that use neither the time nor one of the ``changing`` names."""
        names = self.values(at, state) if self.guards else {}
        return [
            0
            if changing is not None and "time" not in formula.names and changing.isdisjoint(formula.names)
            else sign_of(number_of(formula, names, what))
            for formula, what in self._watched
        ]

    def _rates(self, at: float, state: State) -> State:
        if self._function is not None:
            try:
                since = [self._at(at, since) for since in self.since.values()] if self.since else ()
                now = self.time / NANOSECONDS_PER_SECOND + (self.fraction + at)
                found: State = self._function(now, *since, *state, *self._fixed)
            except UNDECIDED:
                pass
            else:
                return found
        names = self.values(at, state)
        return [number_of(formula, names, "derivative of", name) for name, formula in self._formulas.items()]

    def _bounds(self, formula: Formula, left: float, right: float, states: Sequence[Bounds]) -> Bounds:
        """The bounds of a formula from one time of the present solution to another."""
        known = {}
        for name in formula.names:
            if name in self.names:
                known[name] = states[self.names.index(name)]
            elif name == "time" or name in self.since:
                since = self.since.get(name, 0)
                known[name] = self._at(left, since), self._at(right, since)
            elif isinstance(value := self._held.get(name), (int, float)):
                known[name] = value, value
        return bounds_of(formula, known)

    def _bounds_of_rates(self, left: float, right: float, states: Sequence[Bounds]) -> list[Bounds]:
        return [self._bounds(formula, left, right, states) for formula in self._formulas.values()]


@lru_cache(maxsize=256)
def _unrolled(
    tableau: Tableau, rates: tuple[str, ...], times: int, held: int
) -> tuple[Callable[..., Any], Callable[..., Any]] | None:
    """The functions of a step with these derivatives; None if it would be too long."""
    made: dict[str, Any] = {**KNOWN, "abs": abs, "sqrt": math.sqrt}
    exec(compile(unrolled(tableau, rates, times, held), "<expression>", "exec"), made)
    return (made["attempt"], made["dense"]) if "attempt" in made else None


def number_of(formula: Formula, names: dict[str, Any], *what: object) -> float:
    """The value of a formula, which must be a number; messages call it ``what``, in these words."""
    try:
        result = formula.of(names)
    except UNDECIDED:
        try:
            result = formula(names)
        except EpicycleError as error:
            raise EpicycleError(f"{' '.join(map(str, what))}: {error}") from None
    if isinstance(result, bool) or not isinstance(result, (int, float)):
        raise EpicycleError(f"{' '.join(map(str, what))}: {formula} gives {result!r}, which is not a number")
    return float(result)
