"""Continuous state among discrete events: ODE."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, ClassVar

from .core import (
    NANOSECONDS_PER_SECOND,
    Actor,
    EpicycleError,
    InputPort,
    MappingParameter,
    OutputPort,
    Parameter,
    ParameterError,
    Wake,
    did_you_mean,
)
from .expression import Formula, FormulaParameter, operand
from .expression.enclosure import bounds_of
from .integration import STEPPERS, Bounds, State
from .solution import Guard, Solution, sign_of

_MAX_STEPS = 10_000
_AHEAD = 64  # parts of a step that are searched for crossings at once


class ODE(Actor):
    """A system of ordinary differential equations ``dx/dt = f(x, u, t)`` that is solved between events.

    A bouncing ball:

        ball:
          type: ODE
          initial: {height: 10, speed: 0}
          derivatives: {height: speed, speed: -9.81}
          crossings: {bounce: height}
          directions: {bounce: falling}
          resets: {bounce: {height: 0, speed: -0.8 * speed}}

    Every state is an output port: its value is sent for each ``trigger``, and at each crossing.  Every crossing is an
    output port, too: it sends its number, from 0, when its expression crosses zero, as exactly as the tolerances
    allow.  Resets take place at the crossing, all from the state just before it; what the states send at that tag is
    the state after it.  Names in the expressions that are neither states nor ``time`` are input ports; between
    two tokens an input holds its value.  The states do not depend on the inputs at once, so the actor may stand in a
    loop without delay: what comes at a tag bends the solution from then on.

    A jump of an input, or a reset, that takes a crossing's expression to its other side makes it cross one microstep
    later.  An expression that is zero at the start does not cross there.  Crossings of one kind that come closer
    together than ``min_interval`` end the run with an error: a ball that comes to rest bounces without end (Zeno).

    The solution does not depend on when it is looked at, and has the same bits on every processor.  Numbers are bare,
    in the units that the model chooses, time in s.

    Methods: ``RK23`` (Bogacki-Shampine), ``RK45`` (Dormand-Prince) and ``DOP853`` (Hairer) are explicit Runge-Kutta
    methods.  ``Radau`` (Radau IIA of order 5) and ``BDF`` (order 1 to 5) are for stiff systems: ``Radau`` is the more
    exact one at loose tolerances, ``BDF`` takes fewer evaluations at tight ones.  The steps are those of SciPy's
    solvers of these names, but the arithmetic is our own.

    Steps are as long as the tolerances allow, but longer than 1 s only where nothing can hide in them: bounds on the
    derivatives along the step (interval arithmetic) must show that they stay near what the step has seen.  A crossing
    that comes and goes within an eighth of a second may be missed, if such bounds do not show that there is none.
    With ``max_step`` no step is longer, that check is left out, and its eighth takes the place of the second's.

    Ptolemy: ``DifferentialSystem``, ``LevelCrossingDetector``.
    """

    is_source: ClassVar[bool] = True

    trigger = InputPort(required=False, doc="asks for the states")

    initial = MappingParameter(Parameter(float), doc="the states and their values at the start")
    derivatives = MappingParameter(FormulaParameter(), doc="how fast each state changes, per s")
    crossings = MappingParameter(FormulaParameter(), {}, doc="expressions whose zero crossings are events")
    directions = MappingParameter(
        Parameter(str, choices=("rising", "falling", "both")), {}, doc="which crossings count; both if left out"
    )
    resets = MappingParameter(
        MappingParameter(FormulaParameter()), {}, doc="the values that states take at a crossing; others go on"
    )
    held = MappingParameter(Parameter(float), {}, doc="values of the inputs before their first token; 0 if left out")

    method = Parameter(str, "DOP853", choices=tuple(STEPPERS), doc="the solver; Radau and BDF are for stiff systems")
    relative_tolerance = Parameter(
        float, 1e-10, unit="1", min=1e-13, max=0.1, doc="error per step, relative to each state"
    )
    absolute_tolerance = Parameter(float, 1e-12, above=0, doc="error per step, added to the relative one")
    max_step = Parameter(
        float, None, unit="s", above=0, max=1e6,
        doc="longest step; if left out, 1 s, or what the tolerances allow where nothing can hide in it",
    )  # fmt: skip
    min_interval = Parameter(float, 1e-6, unit="s", above=0, doc="what crossings of one kind keep between them")

    def check(self) -> None:
        self._states = tuple(self.initial)
        self._guards: list[Guard] = []
        if not self._states:
            raise ParameterError("initial: there is no state")
        _same_names("derivatives", self.derivatives, "state", self._states, all_of_them=True)
        _same_names("directions", self.directions, "crossing", self.crossings)
        _same_names("resets", self.resets, "crossing", self.crossings)
        for crossing, reset in self.resets.items():
            _same_names(f"resets: {crossing}", reset, "state", self._states)
        _same_names("held", self.held, "input", [name for name in self.inputs if name != "trigger"])

    def own_ports(self) -> dict[str, InputPort[Any] | OutputPort[Any]]:
        formulas: list[Mapping[str, Formula]] = [self.derivatives, self.crossings, *self.resets.values()]
        ports: dict[str, InputPort[Any] | OutputPort[Any]] = {}
        for state in self.initial:
            ports[state] = OutputPort(float, depends_on=("trigger",), doc="a state")
        for crossing in self.crossings:
            if crossing in ports:
                raise ParameterError(f"crossings: {crossing!r} is the name of a state, too")
            ports[crossing] = OutputPort(int, depends_on=(), doc="number of the zero crossing, from 0")
        for formula in (each for group in formulas for each in group.values()):
            for name in formula.names:
                if name in self.crossings:
                    raise ParameterError(f"{formula} asks for {name!r}, which is a crossing and has no value")
                if name not in ("time", *ports):
                    ports[name] = InputPort(doc="an input, held from token to token")
        return ports

    # -- the run --------------------------------------------------------------------------------------------------

    def initialize(self) -> None:
        self._held = {name: self.held.get(name, 0.0) for name in self.inputs if name != "trigger"}
        self._counts = dict.fromkeys(self.crossings, 0)
        self._latest = dict.fromkeys(self.crossings, -math.inf)
        self._jumps: dict[int, int] = {}
        self._wake: Wake | None = None
        ways = [self.directions.get(name, "both") for name in self.crossings]
        self._guards = [
            Guard(self._crossing(name), partial(self._bounds, formula), way != "falling", way != "rising")
            for (name, formula), way in zip(self.crossings.items(), ways, strict=True)
        ]
        self._begin(self.tag.time, 0.0, [self.initial[name] for name in self._states])
        for guard, side in zip(self._guards, self._signs(0.0, self._solution.at(0.0)), strict=True):
            guard.side = side
        if self._guards:
            self.wake_in(0)

    def _begin(self, time: int, fraction: float, state: State) -> None:
        """Start a solution at ``time`` ns plus a fraction of a nanosecond in s: no rounding adds up over crossings."""
        self._time, self._fraction = time, fraction
        self._solution = Solution(
            self._rates,
            self._bounds_of_rates,
            state,
            self._guards,
            method=self.method,
            tolerance=(self.relative_tolerance, self.absolute_tolerance),
            max_step=self.max_step,
        )

    def _at(self, at: float) -> float:
        """The time in the model at a time of the present solution."""
        return self._time / NANOSECONDS_PER_SECOND + (self._fraction + at)

    def _names(self, at: float, state: State) -> dict[str, Any]:
        """What expressions know at a time of the present solution."""
        names = {**self._held, **dict(zip(self._states, state, strict=True))}
        names["time"] = self._at(at)
        return names

    def _rates(self, at: float, state: State) -> State:
        names = self._names(at, state)
        return [_number(self.derivatives[name], names, "derivative of", name) for name in self._states]

    def _crossing(self, name: str) -> Callable[[float, State], float]:
        formula = self.crossings[name]
        return lambda at, state: _number(formula, self._names(at, state), "crossing", name)

    def _bounds(self, formula: Formula, left: float, right: float, states: Sequence[Bounds]) -> Bounds:
        return bounds_of(formula, self._known_bounds(left, right, states))

    def _bounds_of_rates(self, left: float, right: float, states: Sequence[Bounds]) -> list[Bounds]:
        known = self._known_bounds(left, right, states)
        return [bounds_of(self.derivatives[name], known) for name in self._states]

    def _known_bounds(self, left: float, right: float, states: Sequence[Bounds]) -> dict[str, Bounds]:
        """What the names in expressions lie between, from one time of the present solution to another."""
        numbers = {name: (value, value) for name, value in self._held.items() if isinstance(value, (int, float))}
        return {**numbers, **dict(zip(self._states, states, strict=True)), "time": (self._at(left), self._at(right))}

    def fire(self) -> None:
        now = self._elapsed()
        if self._guards:
            self._solution.search(now)
        at, crossed, self._jumps = now, self._jumps, {}
        crossing = self._solution.crossing
        if crossing is not None and self._moment(crossing.time) <= self.tag.time:
            at, crossed = crossing.time, {**crossed, **crossing.sides}
        if crossed:
            self._cross(at, crossed)
        if crossed or self.trigger.present:
            for name, value in zip(self._states, self._solution.at(0.0 if crossed else now), strict=True):
                self.outputs[name].send(value)
        self._take_inputs()
        self._plan()

    def _elapsed(self) -> float:
        """Seconds since the solution's start, which may lie ahead by a fraction of a nanosecond."""
        return max(0.0, (self.tag.time - self._time) / NANOSECONDS_PER_SECOND - self._fraction)

    def _moment(self, at: float) -> int:
        """The nanosecond that is nearest to a time of the present solution."""
        return self._time + round((self._fraction + at) * NANOSECONDS_PER_SECOND)

    def _cross(self, at: float, crossed: Mapping[int, int]) -> None:
        """Send the crossings, reset what they reset, and begin a new solution."""
        state = self._solution.at(at)
        self._solution.rewind(at)
        before, names = self._signs(at, state), self._names(at, state)
        after = dict(zip(self._states, state, strict=True))
        for number, name in enumerate(self.crossings):
            if number in crossed:
                self._count(name, names["time"])
                for target, formula in self.resets.get(name, {}).items():
                    after[target] = _number(formula, names, f"reset of {target} at", name)
        start = [after[name] for name in self._states]
        moment = self._moment(at)
        self._begin(moment, self._fraction + at - (moment - self._time) / NANOSECONDS_PER_SECOND, start)
        signs = self._signs(0.0, start)
        for number, side in crossed.items():
            if start != state:
                # After a reset at zero, the solution will show which side comes of it.
                side = -side if signs[number] == -side else 0
            self._guards[number].side = side
        self._notice_jumps(before, signs, crossed)

    def _count(self, name: str, time: float) -> None:
        if time - self._latest[name] < self.min_interval:
            raise EpicycleError(
                f"crossing {name!r} comes again after {time - self._latest[name]:.3g} s, which is less than "
                f"min_interval, {self.min_interval:g} s: it may go on so without end (Zeno); "
                f"stop before, for example when {name!r} has come often enough"
            )
        self._latest[name] = time
        self.outputs[name].send(self._counts[name])
        self._counts[name] += 1

    def _take_inputs(self) -> None:
        changed = {}
        for name in self._held:
            port = self.inputs[name]
            if port.present and (value := operand(port.value)) != self._held[name]:
                changed[name] = value
        if not changed:
            return
        now = self._elapsed()
        state = self._solution.at(now)
        self._solution.rewind(now)
        before = self._signs(now, state)
        self._held.update(changed)
        self._begin(self.tag.time, 0.0, state)
        self._notice_jumps(before, self._signs(0.0, state), self._jumps)

    def _signs(self, at: float, state: State) -> list[int]:
        return [sign_of(guard.value(at, state)) for guard in self._guards]

    def _notice_jumps(self, before: list[int], after: list[int], known: Mapping[int, int]) -> None:
        """See which guards are on their other side all at once."""
        for number, guard in enumerate(self._guards):
            if number not in known and before[number] * after[number] < 0:
                if guard.counts(after[number]):
                    self._jumps[number] = after[number]
                guard.side = after[number]

    def _plan(self) -> None:
        """Ask to be fired at the next crossing or, while none is in sight, where the search for it ends.

        A wake-up that an input has overtaken is cancelled, for the solution it was found on is no more.
        """
        if self._wake is not None and not self._wake.due:
            self._wake.cancel()
        self._wake = None
        if self._jumps:
            self._wake = self.wake_in(0)
            return
        if not self._guards:
            return
        solution, parts = self._solution, 0
        while solution.crossing is None and self._moment(solution.searched) <= self.tag.time:
            solution.look()
            parts += 1
            if parts > _MAX_STEPS:
                raise EpicycleError(f"the solver takes more than {_MAX_STEPS:,} steps within a nanosecond")
        while solution.crossing is None and solution.searched < solution.end and parts < _AHEAD:
            solution.look()
            parts += 1
        moment = self._moment(solution.searched if solution.crossing is None else solution.crossing.time)
        self._wake = self.context.wake(self, moment)


def _number(formula: Formula, names: Mapping[str, Any], what: str, name: str) -> float:
    """The value of a formula, which must be a number; ``what`` it is of, for messages."""
    try:
        result = formula(names)
    except EpicycleError as error:
        raise EpicycleError(f"{what} {name}: {error}") from None
    if isinstance(result, bool) or not isinstance(result, (int, float)):
        raise EpicycleError(f"{what} {name}: {formula} gives {result!r}, which is not a number")
    return float(result)


def _same_names(label: str, given: Mapping[str, object], kind: str, known: Any, *, all_of_them: bool = False) -> None:
    """Every name that is given is known, and, if need be, the other way round."""
    for name in given:
        if name not in known:
            raise ParameterError(
                f"{label}: there is no {kind} {name!r}{did_you_mean(name, known)}; "
                f"{kind}s: {', '.join(known) or 'none'}"
            )
    for name in known if all_of_them else ():
        if name not in given:
            raise ParameterError(f"{label}: {name!r} is missing")
