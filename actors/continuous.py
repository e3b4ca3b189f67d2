"""Continuous state among discrete events: ODE."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from .core import (
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
from .expression import ExpressionError, Formula, FormulaParameter, check_no_constant, operand
from .integration import STEPPERS, check_step
from .trajectory import Trajectory, number_of


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

    Every state is an output port: its value is sent for each ``trigger`` and at each crossing.  Every crossing is also
    an output port: when its expression crosses zero, it sends the number of the crossing, from 0, at a time as exact as
    the tolerances allow.  Resets take place at the crossing, all computed from the state just before it; at that tag,
    the states send their values after it.  Names in the expressions that are neither states nor ``time`` are input
    ports; an input holds its value between tokens.  The states do not depend on the inputs within the same tag, so the
    actor may be part of a loop without delay: a token changes the derivatives from its tag on.

    If a jump of an input, or a reset, takes a crossing's expression to its other side, it crosses one microstep later.
    An expression that is zero at the start does not cross there.  Crossings of one kind that follow each other within
    ``min_interval`` end the run with an error: a ball that comes to rest bounces without end (Zeno).

    What several expressions need is said once: ``where: {slip: wheel / rpm}`` gives ``slip`` a meaning in all of them.

    The solution does not depend on when it is requested, and has the same bits on every processor.  Numbers have no
    units: the model chooses them; time is in s.

    Methods: ``RK23`` (Bogacki-Shampine), ``RK45`` (Dormand-Prince) and ``DOP853`` (Hairer) are explicit Runge-Kutta
    methods.  ``Radau`` (Radau IIA of order 5) and ``BDF`` (order 1 to 5) are for stiff systems: ``Radau`` is more exact
    at loose tolerances, ``BDF`` takes fewer evaluations at tight ones.  The steps are those of SciPy's solvers of these
    names, but the arithmetic is our own.  ``Euler`` goes along straight lines in steps of ``max_step``, as many
    published models are simulated; it knows no tolerances.  No method is needed where each derivative is, by its form,
    linear in its own state and depends on nothing else that moves: a line or an exponential is exact.

    Steps are as long as the tolerances allow, but longer than 1 s only where nothing can hide in them: bounds on the
    derivatives along the step (interval arithmetic) must show that they stay near the values that the step has
    evaluated.  Two crossings within an eighth of a second may be missed unless such bounds exclude them. With
    ``max_step``, no step is longer than that, the bounds are not checked, and an eighth of ``max_step`` takes the place
    of an eighth of a second.

    Ptolemy: ``DifferentialSystem``, ``LevelCrossingDetector``.
    """

    is_source: ClassVar[bool] = True

    trigger = InputPort(required=False, doc="requests the states")

    initial = MappingParameter(Parameter(float), doc="the states and their values at the start")
    derivatives = MappingParameter(FormulaParameter(), doc="the derivative of each state, per s")
    where = MappingParameter(
        FormulaParameter(), {}, doc="names for quantities in the expressions; each may use those before it"
    )
    crossings = MappingParameter(FormulaParameter(), {}, doc="expressions whose zero crossings are events")
    directions = MappingParameter(
        Parameter(str, choices=("rising", "falling", "both")),
        {},
        doc="which direction of a crossing counts; both if left out",
    )
    resets = MappingParameter(
        MappingParameter(FormulaParameter()),
        {},
        doc="new values of states at a crossing; other states stay as they are",
    )
    held = MappingParameter(Parameter(float), {}, doc="values of the inputs before their first token; 0 if left out")

    method = Parameter(str, "DOP853", choices=tuple(STEPPERS), doc="the solver; Radau and BDF are for stiff systems")
    relative_tolerance = Parameter(
        float, 1e-10, unit="1", min=1e-13, max=0.1, doc="error per step, relative to each state"
    )
    absolute_tolerance = Parameter(float, 1e-12, above=0, doc="absolute error per step, added to the relative one")
    max_step = Parameter(
        float, None, unit="s", above=0, max=1e6,
        doc="longest step; if left out, 1 s, or as long as the tolerances allow where nothing can hide in it",
    )  # fmt: skip
    min_interval = Parameter(float, 1e-6, unit="s", above=0, doc="shortest time between crossings of one kind")

    def check(self) -> None:
        self._states = tuple(self.initial)
        if not self._states:
            raise ParameterError("initial: the mapping is empty; give at least one state")
        check_step(self.method, self.max_step)
        _same_names("derivatives", self.derivatives, "state", self._states, all_of_them=True)
        _same_names("directions", self.directions, "crossing", self.crossings)
        _same_names("resets", self.resets, "crossing", self.crossings)
        for crossing, reset in self.resets.items():
            _same_names(f"resets: {crossing}", reset, "state", self._states)
        self.event_outputs = tuple(self.crossings)
        _same_names("held", self.held, "input", [name for name in self.inputs if name != "trigger"])

    def own_ports(self) -> dict[str, InputPort[Any] | OutputPort[Any]]:
        self._rates = self._defined("derivatives", self.derivatives)
        self._crossed = self._defined("crossings", self.crossings)
        self._reset = {name: self._defined(f"resets: {name}", each) for name, each in self.resets.items()}
        formulas: list[Mapping[str, Formula]] = [self._rates, self._crossed, *self._reset.values()]
        ports: dict[str, InputPort[Any] | OutputPort[Any]] = {}
        for state in self.initial:
            check_no_constant("initial", state)
            ports[state] = OutputPort(float, depends_on=("trigger",), doc="a state")
        for crossing in self.crossings:
            if crossing in ports:
                raise ParameterError(f"crossings: {crossing!r} is also the name of a state")
            ports[crossing] = OutputPort(int, depends_on=(), doc="the number of the crossing, from 0")
        for formula in (each for group in formulas for each in group.values()):
            for name in formula.names:
                if name in self.crossings:
                    raise ParameterError(f"{formula} uses {name!r}, which is a crossing and has no value")
                if name not in ("time", *ports):
                    ports[name] = InputPort(doc="an input, held between tokens")
        return ports

    def _defined(self, label: str, formulas: Mapping[str, Formula]) -> dict[str, Formula]:
        """Formulas with what ``where`` says in the place of its names."""
        known: dict[str, Formula] = {}
        for name, formula in self.where.items():
            if name in (*self.initial, *self.crossings, "time", "trigger"):
                raise ParameterError(f"where: {name!r} is the name of something else; choose another")
            check_no_constant("where", name)
            known[name] = _replaced(f"where: {name}", formula, known)
        return {name: _replaced(f"{label}: {name}", formula, known) for name, formula in formulas.items()}

    # -- the run --------------------------------------------------------------------------------------------------

    def initialize(self) -> None:
        self._held = {name: self.held.get(name, 0.0) for name in self.inputs if name != "trigger"}
        self._counts = dict.fromkeys(self.crossings, 0)
        self._latest = dict.fromkeys(self.crossings, -math.inf)
        self._jumps: dict[int, int] = {}
        self._wake: Wake | None = None
        self._trajectory = Trajectory(
            {name: self._rates[name] for name in self._states},
            self._held,
            method=self.method,
            tolerance=(self.relative_tolerance, self.absolute_tolerance),
            max_step=self.max_step,
        )
        for name, formula in self._crossed.items():
            way = self.directions.get(name, "both")
            self._trajectory.watch(formula, f"crossing {name}", rising=way != "falling", falling=way != "rising")
        start = [self.initial[name] for name in self._states]
        self._trajectory.begin(self.tag.time, 0.0, start)
        for guard, side in zip(self._trajectory.guards, self._trajectory.signs(0.0, start), strict=True):
            guard.side = side
        if self.crossings:
            self.wake_in(0)

    def fire(self) -> None:
        trajectory, solution = self._trajectory, self._trajectory.solution
        now = trajectory.elapsed(self.tag.time)
        if self.crossings:
            solution.search(now)
        at, crossed, self._jumps = now, self._jumps, {}
        crossing = solution.crossing
        if crossing is not None and trajectory.moment(crossing.time) <= self.tag.time:
            at, crossed = crossing.time, {**crossed, **crossing.sides}
        if crossed:
            self._cross(at, crossed)
        if crossed or self.trigger.present:
            for name, value in zip(self._states, trajectory.solution.at(0.0 if crossed else now), strict=True):
                self.outputs[name].send(value)
        self._take_inputs()
        self._plan()

    def _cross(self, at: float, crossed: Mapping[int, int]) -> None:
        """Send the crossings, apply their resets, and begin a new solution."""
        trajectory = self._trajectory
        state = trajectory.solution.at(at)
        trajectory.solution.rewind(at)
        before, names = trajectory.signs(at, state), trajectory.values(at, state)
        after = dict(zip(self._states, state, strict=True))
        for number, name in enumerate(self.crossings):
            if number in crossed:
                self._count(name, names["time"])
                for target, formula in self._reset.get(name, {}).items():
                    after[target] = number_of(formula, names, f"reset of {target} at {name}")
        start = [after[name] for name in self._states]
        trajectory.begin_at(at, start)
        signs = trajectory.signs(0.0, start)
        for number, side in crossed.items():
            if start != state:
                # After a reset to zero, the solution will show which side it goes to.
                side = -side if signs[number] == -side else 0
            trajectory.guards[number].side = side
        self._notice_jumps(before, signs, crossed)

    def _count(self, name: str, time: float) -> None:
        if time - self._latest[name] < self.min_interval:
            raise EpicycleError(
                f"crossing {name!r} comes again after {time - self._latest[name]:.3g} s, which is less than "
                f"min_interval, {self.min_interval:g} s: it may repeat without end (Zeno); end the run earlier, for "
                f"example after a number of {name!r}"
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
        trajectory = self._trajectory
        now = trajectory.elapsed(self.tag.time)
        state = trajectory.solution.at(now)
        trajectory.solution.rewind(now)
        before = trajectory.signs(now, state, changed.keys())
        self._held.update(changed)
        trajectory.begin(self.tag.time, 0.0, state)
        self._notice_jumps(before, trajectory.signs(0.0, state, changed.keys()), self._jumps)

    def _notice_jumps(self, before: list[int], after: list[int], known: Mapping[int, int]) -> None:
        """Find the guards that a jump has taken to their other side."""
        for number, guard in enumerate(self._trajectory.guards):
            if number not in known and before[number] * after[number] < 0:
                if guard.counts(after[number]):
                    self._jumps[number] = after[number]
                guard.side = after[number]

    def _plan(self) -> None:
        """Request a firing at the next crossing or, while none is in sight, where the search for it ends.

        A wake-up found before an input came is cancelled, because its solution no longer exists.
        """
        if self._wake is not None and not self._wake.due:
            self._wake.cancel()
        self._wake = None
        if self._jumps:
            self._wake = self.wake_in(0)
        elif self.crossings:
            self._wake = self.context.wake(self, self._trajectory.next_look(self.tag.time))


def _replaced(label: str, formula: Formula, known: Mapping[str, Formula]) -> Formula:
    try:
        return formula.replacing(known)
    except ExpressionError as error:
        raise ParameterError(f"{label}, with the quantities of 'where' in it: {error}") from None


def _same_names(label: str, given: Mapping[str, object], kind: str, known: Any, *, all_of_them: bool = False) -> None:
    """Check that every given name is known and, if required, that every known name is given."""
    for name in given:
        if name not in known:
            raise ParameterError(
                f"{label}: there is no {kind} {name!r}{did_you_mean(name, known)}; "
                f"{kind}s: {', '.join(known) or 'none'}"
            )
    for name in known if all_of_them else ():
        if name not in given:
            raise ParameterError(f"{label}: {name!r} is missing")
