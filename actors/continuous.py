"""Continuous state among discrete events: ODE."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

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
from .segment import METHODS, Crossing, Guard, Segment, State

_MAX_STEPS = 10_000


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

    The solution does not depend on when it is looked at.  Numbers are bare, in the units that the model chooses, time
    in s.  Solvers: ``scipy.integrate``.  Ptolemy: ``DifferentialSystem``, ``LevelCrossingDetector``.
    """

    is_source: ClassVar[bool] = True

    trigger: InputPort[Any] = InputPort(Any, required=False, doc="asks for the states")

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

    method = Parameter(str, "DOP853", choices=METHODS, doc="the solver; Radau and BDF are for stiff systems")
    relative_tolerance = Parameter(
        float, 1e-10, unit="1", min=1e-13, max=0.1, doc="error per step, relative to each state"
    )
    absolute_tolerance = Parameter(float, 1e-12, min=1e-300, doc="error per step, added to the relative one")
    max_step = Parameter(
        float, 1.0, unit="s", min=1e-9, max=1e6,
        doc="longest step; two crossings within an eighth of it may go unnoticed",
    )  # fmt: skip
    min_interval = Parameter(float, 1e-6, unit="s", min=1e-9, doc="what crossings of one kind keep between them")

    def __init__(self, path: str, **parameters: object) -> None:
        super().__init__(path, **parameters)
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
        formulas: list[Formula] = [*self.derivatives.values(), *self.crossings.values()]
        for reset in self.resets.values():
            formulas += reset.values()
        ports: dict[str, InputPort[Any] | OutputPort[Any]] = {}
        for state in self.initial:
            ports[state] = OutputPort(float, depends_on=("trigger",), doc="a state")
        for crossing in self.crossings:
            if crossing in ports:
                raise ParameterError(f"crossings: {crossing!r} is the name of a state, too")
            ports[crossing] = OutputPort(int, depends_on=(), doc="number of the zero crossing, from 0")
        for formula in formulas:
            for name in formula.names:
                if name in self.crossings:
                    raise ParameterError(f"{formula} asks for {name!r}, which is a crossing and has no value")
                if name not in ("time", *ports):
                    ports[name] = InputPort(Any, doc="an input, held from token to token")
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
            Guard(self._number(formula, f"crossing {name}"), way != "falling", way != "rising")
            for (name, formula), way in zip(self.crossings.items(), ways, strict=True)
        ]
        self._derivatives = [self._number(self.derivatives[name], f"derivative of {name}") for name in self._states]
        self._begin(self.tag.time, 0.0, np.array([self.initial[name] for name in self._states], dtype=float))
        for guard, side in zip(self._guards, self._signs(0.0, self._segment.at(0.0)), strict=True):
            guard.side = side
        if self._guards:
            self.wake_in(0)

    def _begin(self, time: int, fraction: float, state: State) -> None:
        """Start a solution at ``time`` ns plus a fraction of a nanosecond in s: no rounding adds up over crossings."""
        self._time, self._fraction = time, fraction
        self._segment = Segment(
            lambda at, x: np.array([derivative(at, x) for derivative in self._derivatives]),
            state,
            self._guards,
            method=self.method,
            tolerance=(self.relative_tolerance, self.absolute_tolerance),
            max_step=self.max_step,
        )

    def _names(self, at: float, state: State) -> dict[str, Any]:
        """What expressions know at a time of the present segment."""
        time = self._time / NANOSECONDS_PER_SECOND + (self._fraction + at)
        return {**self._held, **dict(zip(self._states, state.tolist(), strict=True)), "time": time}

    def _number(self, formula: Formula, what: str) -> Any:
        def value(at: float, state: State) -> float:
            try:
                result = formula(self._names(at, state))
            except EpicycleError as error:
                raise EpicycleError(f"{what}: {error}") from None
            if isinstance(result, bool) or not isinstance(result, (int, float)):
                raise EpicycleError(f"{what}: {formula} gives {result!r}, which is not a number")
            return float(result)

        return value

    def fire(self) -> None:
        now = self._elapsed()
        self._segment.at(now)  # steps are taken up to here, and searched for crossings
        crossed = dict(self._jumps)
        self._jumps.clear()
        crossing = self._segment.crossing
        if crossing is not None and self._moment(crossing.time) <= self.tag.time:
            crossed = {**crossed, **crossing.sides}
            self._cross(crossing, crossed)
        elif crossed:
            self._cross(Crossing(now, crossed), crossed)
        if crossed or self.trigger.present:
            at = 0.0 if crossed else now
            for name, value in zip(self._states, self._segment.at(at).tolist(), strict=True):
                self.outputs[name].send(value)
        self._take_inputs()
        self._plan()

    def _elapsed(self) -> float:
        """Seconds since the solution's start, which may lie ahead by a fraction of a nanosecond."""
        return max(0.0, (self.tag.time - self._time) / NANOSECONDS_PER_SECOND - self._fraction)

    def _moment(self, at: float) -> int:
        """The nanosecond that is nearest to a time of the present segment."""
        return self._time + round((self._fraction + at) * NANOSECONDS_PER_SECOND)

    def _cross(self, crossing: Crossing, crossed: Mapping[int, int]) -> None:
        """Send the crossings, reset what they reset, and begin a new solution."""
        at, state = crossing.time, self._segment.at(crossing.time)
        before, time = self._signs(at, state), self._names(at, state)["time"]
        after = dict(zip(self._states, state.tolist(), strict=True))
        for number, name in enumerate(self.crossings):
            if number in crossed:
                self._count(name, time)
                for target, formula in self.resets.get(name, {}).items():
                    after[target] = self._number(formula, f"reset of {target} at {name}")(at, state)
        start = np.array([after[name] for name in self._states])
        moment = self._moment(at)
        self._begin(moment, self._fraction + at - (moment - self._time) / NANOSECONDS_PER_SECOND, start)
        signs = self._signs(0.0, start)
        for number, side in crossed.items():
            if not np.array_equal(start, state):
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
        state = self._segment.at(self._elapsed())
        before = self._signs(self._elapsed(), state)
        self._held.update(changed)
        self._begin(self.tag.time, 0.0, state)
        self._notice_jumps(before, self._signs(0.0, state), self._jumps)

    def _signs(self, at: float, state: State) -> list[int]:
        return [_sign(guard.value(at, state)) for guard in self._guards]

    def _notice_jumps(self, before: list[int], after: list[int], known: Mapping[int, int]) -> None:
        """See which guards are on their other side all at once."""
        for number, guard in enumerate(self._guards):
            if number not in known and before[number] * after[number] < 0:
                if guard.counts(after[number]):
                    self._jumps[number] = after[number]
                guard.side = after[number]

    def _plan(self) -> None:
        """Ask to be fired at the next crossing or, while none is in sight, at the end of the step that is known.

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
        steps = 0
        while self._segment.crossing is None and self._moment(self._segment.end) <= self.tag.time:
            self._segment.extend()
            steps += 1
            if steps > _MAX_STEPS:
                raise EpicycleError(f"the solver takes more than {_MAX_STEPS:,} steps within a nanosecond")
        crossing = self._segment.crossing
        moment = self._moment(self._segment.end if crossing is None else crossing.time)
        self._wake = self.context.wake(self, moment)


def _sign(value: float) -> int:
    return (value > 0) - (value < 0)


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
