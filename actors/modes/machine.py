"""StateMachine: modes, transitions, variables that flow, and guards that are events."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection
from math import inf
from typing import Any, ClassVar, Final, Protocol

from ..core import (
    EpicycleError,
    InputPort,
    MappingParameter,
    OutputPort,
    Parameter,
    ParameterError,
    Tag,
    Wake,
    any_parameter,
    did_you_mean,
    to_seconds,
)
from ..expression import UNDECIDED, Formula, check_no_constant, operand
from ..integration import STEPPERS, check_step
from ..trajectory import number_of
from .borders import Borders
from .chart import Chart, Rule
from .condition import TIMES, Comparison, condition_of, type_of
from .guard import is_true
from .modal import ModalActor
from .text import Action, ModesParameter, TransitionsParameter

_PRESENT: Final = "_is_present"


class Refinements(Protocol):
    """The refinements of a machine's modes, as the engine provides them."""

    def begin(self, mode: str) -> None:
        """Start, or restart, in a mode."""

    def change(self, mode: str, *, history: bool) -> None:
        """Leave the refinement of the present mode and enter that of another: where it was left, or from its start."""

    def raise_failure(self) -> None:
        """Raise the error of the present refinement, which no transition handles."""


class StateMachine(ModalActor):
    """A state machine with one transition per line, and variables that may flow.

    A thermostat with a room:

        thermostat:
          type: StateMachine
          variables: {temperature: 20}
          modes:
            heating: {flow: {temperature: 0.2 - 0.01 * temperature + 0.1}}
            idle: {flow: {temperature: 0.1 - 0.01 * temperature}}
          transitions:
            - heating -> idle when temperature >= 22 do heater = false
            - idle -> heating when temperature <= 18 do heater = true

    A transition is ``a, b -> c``, followed by ``else``, ``immediate``, ``nondeterministic``, ``priority 2`` or
    ``probability 0.1`` or ``rate 3``, then ``on`` inputs of which one must have a token, ``after`` a time since the
    entry, ``when`` a guard, ``do`` actions; or a mapping with these keys.  Expressions are in the language of
    ``${...}``.  Names in them are variables, ``time`` (s), ``mode_time`` (s since the mode was entered), or else input
    ports.  A guard that uses an input without a token does not hold; ``x_is_present`` states whether ``x`` has one, and
    inputs in ``held`` keep their latest.  An action sets a variable, or sends from an output port of that name.  If
    several tokens arrive together at one input, each gets its own reaction, at the following microsteps.

    In a mode with ``flow``, variables follow differential equations, as in an ``ODE``.  In a guard, a comparison over
    them, or over times, is an event at the nanosecond at which it changes.  If its transition moves a variable off the
    border, the comparison holds again only after it has not held.  ``trigger`` makes all variables be sent, each from
    its own output port.

    Ptolemy: ``FSMActor``, ``ModalModel``.
    """

    copies_share = (*ModalActor.copies_share, "modes", "transitions", "_conditions", "_comparisons", "_guards")
    is_source: ClassVar[bool] = True
    refinements: Refinements | None = None  # of its modes, if it belongs to a composite
    handed: tuple[str, ...] = ()  # variables that are sent to refinements whenever a mode is entered

    trigger = InputPort(required=False, doc="makes all variables be sent")

    modes = ModesParameter(object, doc="their names, or a mapping of names to: flow, entry, exit, final, doc")
    transitions = TransitionsParameter(object, (), doc="one per line, or {from, to, on, after, when, do, ...}")
    initial = Parameter(str, None, doc="the mode in which it starts; the first if left out")
    variables = MappingParameter(Parameter(object), {}, doc="values that it keeps, with their initial values")
    held = MappingParameter(
        any_parameter(None), {}, doc="inputs that keep their latest token, with a value before the first, or null"
    )

    method = Parameter(str, "DOP853", choices=tuple(STEPPERS), doc="the solver of flows; see ODE")
    relative_tolerance = Parameter(float, 1e-10, unit="1", min=1e-13, max=0.1, doc="error per step, see ODE")
    absolute_tolerance = Parameter(float, 1e-12, above=0, doc="error per step, added to the relative one")
    max_step = Parameter(float, None, unit="s", above=0, max=1e6, doc="longest step; see ODE")

    def own_ports(self) -> dict[str, InputPort[Any] | OutputPort[Any]]:
        actions = [*(each for one in self.transitions for each in one.do), *self._at_borders()]
        read = [formula for _, formula in actions]
        for one in self.transitions:
            read += [each for each in (one.when, one.after, one.probability, one.rate) if each is not None]
        read += [formula for mode in self.modes.values() for formula in mode.flow.values()]
        ports: dict[str, InputPort[Any] | OutputPort[Any]] = {}
        for name in self.variables:
            if name in self._reserved:
                raise ParameterError(
                    f"variables: {name!r} is a reserved name; choose another", ("variables", name), of_key=True
                )
            check_no_constant("variables", name)
            ports[name] = OutputPort(self._type(name), doc="a variable, sent on request")
        named = [
            *(name for formula in read for name in formula.names),
            *(name for one in self.transitions for name in one.on),
        ]
        for name in named:
            name = name.removesuffix(_PRESENT)
            if name not in (*self._reserved, "trigger", *ports):
                ports[name] = InputPort(required=False, multi=True, doc="a name in guards or actions")
        for name, _ in actions:
            if name in self._reserved or isinstance(ports.get(name), InputPort):
                what = "an input because it is read" if name in ports else "a time"
                raise ParameterError(
                    f"{name} = ...: {name!r} is {what}; declare it as a variable to set it, or rename it"
                )
            if name not in ports:
                kinds = {type_of(formula, self._type) for each, formula in actions if each == name}
                ports[name] = OutputPort(kinds.pop() if len(kinds) == 1 else Any, doc="sent by actions")
        return ports

    def _type(self, name: str) -> Any:
        """The type of a name's value, as far as it is known."""
        if name in TIMES:
            return float
        kind = type(self.variables.get(name))
        return float if kind in (int, float) else kind if kind in (bool, str) else Any

    @property
    def catches(self) -> bool:
        """Whether it has error transitions."""
        return any(one.error for one in self.transitions)

    @property
    def _reserved(self) -> tuple[str, ...]:
        return (*TIMES, "error") if self.catches else TIMES

    def _at_borders(self) -> list[Action]:
        return [each for mode in self.modes.values() for each in (*mode.entry, *mode.exit)]

    def check(self) -> None:
        check_step(self.method, self.max_step)
        rules = [
            Rule(
                each.from_, each.to, each.on, each.when, each.after, each.probability, each.do,
                each.priority, each.else_, each.immediate, each.nondeterministic,
                each.preemptive, each.history, each.error, each.rate, place,
            )
            for place, each in enumerate(self.transitions)
        ]  # fmt: skip
        final = [name for name, mode in self.modes.items() if mode.final]
        self._chart = Chart(tuple(self.modes), self.initial, final, rules)
        self._inputs = [name for name in self.inputs if name != "trigger"]
        self._set = frozenset(self.variables)
        self._catches = self.catches
        for name in self.held:
            _check_name(("held", name), name, "input", self._inputs)
        for name, mode in self.modes.items():
            for variable in mode.flow:
                _check_name(("modes", name, "flow", variable), variable, "variable", self.variables)
        numbers = {*self.held, *self.variables}
        self._conditions: dict[str, dict[Rule, Formula]] = {}  # guards with names in the place of comparisons
        self._comparisons: dict[str, tuple[Comparison, ...]] = {}
        for name, mode in self.modes.items():
            moving = {*mode.flow, *TIMES}
            found = self._conditions[name] = {}
            watched: list[Comparison] = []
            for rule in self._chart.leaving[name]:
                if rule.guard is not None:
                    found[rule], comparisons = condition_of(rule.guard, moving, numbers, len(watched))
                    watched += comparisons
            self._comparisons[name] = tuple(watched)
        self._still = frozenset(name for name, mode in self.modes.items() if not (mode.flow or self._comparisons[name]))
        rules = [rule for leaving in self._chart.leaving.values() for rule in leaving]
        self.is_preemptive = any(rule.preemptive for rule in rules)
        read = [each for rule in rules for each in (rule.guard, rule.delay, rule.probability, rule.rate) if each]
        read += [formula for each in self.transitions for _, formula in each.do]
        read += [formula for _, formula in self._at_borders()]
        self._asks_time = any(name in TIMES for formula in read for name in formula.names)
        self._asked_of = tuple(
            (name, name.removesuffix(_PRESENT))
            for name in dict.fromkeys(name for formula in read for name in formula.names)
            if name.endswith(_PRESENT) and name not in self.inputs
        )

    # -- the run --------------------------------------------------------------------------------------------------

    def initialize(self) -> None:
        super().initialize()
        self.is_asked = False  # whether its refinement has fired
        if self.refinements is not None:
            self.refinements.begin(self._current)
        self._known: dict[str, Any] = dict(self.variables)
        self._known |= {name: value for name, value in self.held.items() if value is not None}
        self._queues = [(name, self.inputs[name], deque[Any]()) for name in self._inputs]
        self._tokens: dict[str, Any] = {}  # of the present reaction
        self._scope: dict[str, Any] = {}  # what names mean in it
        self._entered = self.context.time
        self._guards = self._conditions[self._current]
        self._borders = Borders(
            self._known,
            method=self.method,
            tolerance=(self.relative_tolerance, self.absolute_tolerance),
            max_step=self.max_step,
        )
        self._has_changed = False  # whether a comparison changes now
        self._prepared: Tag | None = None
        self._wake: Wake | None = None

    def preempt(self) -> bool:
        """Check preemptive transitions before the refinement of the mode fires; return whether one was taken."""
        self._prepare()
        if self._is_to_react:
            self._look()
            self.react(preempts=True)
        return self._reacted == self.tag

    def _prepare(self) -> None:
        self.take_tokens()
        tag = self.context.tag
        if self._prepared != tag:
            self._prepared = tag
            self._has_changed = not self._borders.is_still and self._borders.advance(self.context.time)
        if self.held and self._tokens:
            self._hold_tokens()

    @property
    def _is_to_react(self) -> bool:
        """Whether there is a reason to react: a token, a changing comparison, an expired delay, or its refinement."""
        is_told = bool(self._tokens) or self.is_asked or self.error is not None
        return is_told or self._has_changed or self.is_called

    def _look(self) -> None:
        """Gather what names mean: a token, a variable or held input, a comparison, or a time."""
        tokens = self._tokens
        self._scope = scope = {**self._borders.truths, **self._known, **tokens}
        if self._asks_time:
            time = self.context.time
            scope["time"], scope["mode_time"] = to_seconds(time), to_seconds(time - self._entered)
        for name, port in self._asked_of:
            scope[name] = port in tokens
        if self._catches:
            scope["error"] = self.error or ""

    def fire(self) -> None:
        self._prepare()
        if self._is_to_react:
            self._look()
            self.react()
            if self.error is not None and self.refinements is not None:
                self.refinements.raise_failure()
        if self._is_new:
            for name in self.handed:
                self.outputs[name].send(self._known[name])
        self.finish()
        self.is_asked = False
        if self.trigger.present:
            self._tell()
        self._tokens, self._scope = {}, {}
        self.rests()
        if self._wake is not None or not self._borders.is_still:
            self._watch()

    def _watch(self) -> None:
        """Be woken when a comparison changes."""
        time, wake = self._borders.next_time(self.context.time), self._wake
        if wake is not None and not self.is_due(wake):
            if wake.time == time:
                return
            wake.cancel()
        self._wake = None if time is None else self.context.wake(self, time)

    def rests(self) -> None:
        """Called when a reaction is over: ask for another one if tokens are left."""
        for _, _, queue in self._queues:
            if queue:
                self.wake_in(0)
                return

    @property
    def next_time(self) -> int | None:
        """When (ns) it must fire next without a token."""
        wakes = (self._wake, self._again, self._first, *self._timers.values())
        return min((wake.time for wake in wakes if wake is not None and not self.is_due(wake)), default=None)

    def take_tokens(self) -> None:
        """Take the first waiting token of each input, unless that was done before the refinement fired."""
        tokens = self._tokens
        for name, port, queue in self._queues:
            if name not in tokens:
                if port.present:
                    queue.extend(port.tokens)
                if queue:
                    tokens[name] = queue.popleft()

    def _hold_tokens(self) -> None:
        changed = {name: operand(self._tokens[name]) for name in self.held if name in self._tokens}
        changed = {
            name: value for name, value in changed.items() if name not in self._known or self._known[name] != value
        }
        self._known |= changed
        if changed:
            self._borders.change(changed.keys(), self.context.time)

    def _tell(self) -> None:
        for name in self.variables:
            self.outputs[name].send(self._known[name])

    # -- guards and actions ---------------------------------------------------------------------------------------

    def is_present(self, port: str) -> bool:
        return port in self._tokens

    def hears(self, rule: Rule) -> bool:
        return not self._tokens.keys().isdisjoint(rule.on)

    def _take(self, rule: Rule) -> None:
        self._act(self.modes[self._current].exit)
        self._act(rule.act)
        self.error = None
        if self.refinements is not None:
            self.refinements.change(rule.target, history=rule.history)
        self._enter(rule.target)

    def enters(self, mode: str) -> None:
        if self._catches:  # a transition has handled it
            self._scope["error"] = ""
        self._act(self.modes[mode].entry)
        self._entered, self._guards = self.context.time, self._conditions[mode]
        if not (self._borders.is_still and mode in self._still):
            self._enter_borders(mode)
        self._scope["mode_time"] = 0.0

    def _enter_borders(self, mode: str) -> None:
        for name in self._borders.truths:
            self._scope.pop(name, None)
        self._borders.enter(mode, self.modes[mode].flow, self._comparisons[mode], self._entered)
        self._scope.update(self._borders.truths)

    def _act(self, actions: tuple[Action, ...]) -> None:
        for name, formula in actions:
            if name in self._set:
                self.sets(name, formula)
            elif formula.source in self._tokens:
                self.outputs[name].send(self._tokens[formula.source])  # unchanged
            else:
                self.outputs[name].send(self._result(formula))

    def sets(self, name: str, formula: Formula) -> None:
        """Called by an action that sets a variable."""
        self._known[name] = self._scope[name] = self._result(formula)

    def _result(self, formula: Formula) -> Any:
        try:
            return formula.of(self._scope)
        except UNDECIDED:
            return formula.decided(self._values(formula))

    def probability_of(self, rule: Rule) -> float:
        found = self._number_of(rule.probability, rule, "probability")
        if not 0.0 <= found <= 1.0:
            raise EpicycleError(f"{rule}: {found:g} is not a probability, which is from 0 to 1")
        return found

    def delay_of(self, rule: Rule) -> float:
        return self._number_of(rule.delay, rule, "after")

    def holds(self, rule: Rule) -> bool:
        if rule.guard is None:
            return True
        condition = self._guards[rule]
        try:
            found = condition.of(self._scope)
        except UNDECIDED:
            pass
        else:
            if isinstance(found, (int, float)):
                return bool(found)
        try:
            return is_true(condition, self._scope)
        except EpicycleError:
            return is_true(rule.guard, self._scope)  # which reports the error in the model's terms

    def goes_on(self) -> bool:
        if not self._exits.alone:
            return False
        if self._tokens:
            self._look_ahead()
        return super().goes_on()

    def race(self) -> None:
        self._look_ahead()
        super().race()

    def _look_ahead(self) -> None:
        """Gather what names mean while no token comes."""
        self._tokens = {}
        self._look()

    def rate_of(self, rule: Rule) -> float:
        found = self._number_of(rule.rate, rule, "rate")
        if not 0.0 <= found < inf:
            raise EpicycleError(f"{rule}: {found:g} is not a rate, which is a number >= 0")
        return found

    def _number_of(self, formula: Formula, *what: object) -> float:
        try:
            found = formula.of(self._scope)
        except UNDECIDED:
            found = None
        return found if type(found) is float else number_of(formula, self._values(formula), *what)

    def _values(self, formula: Formula) -> dict[str, Any]:
        """The present values of the names in an expression, without inputs that have no token."""
        return {name: operand(self._scope[name]) for name in formula.names if name in self._scope}


def _check_name(keys: tuple[str, ...], name: str, kind: str, known: Collection[str]) -> None:
    if name not in known:
        where, near = ": ".join(keys[:-1]), did_you_mean(name, known)
        message = f"{where}: there is no {kind} {name!r}{near}; {kind}s: {', '.join(known) or 'none'}"
        raise ParameterError(message, keys, of_key=True)
