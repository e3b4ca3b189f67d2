"""Modal actors: the meaning of modes and transitions, in models and in Python.

The meaning
-----------
A machine is in one mode.  It reacts once per tag at which it fires:

1. A transition that leaves the mode is *enabled* if its delay is over, one of its trigger ports has a token, and its
   guard holds.  An ``otherwise`` transition is enabled if no other one is.  Of the transitions with a ``probability``,
   one is drawn: their probabilities divide the range from 0 to 1, one after the other.
2. Of the enabled transitions, only those with the lowest ``priority`` count.  If there are several, all must be
   nondeterministic, and one is drawn; otherwise, the run ends with an error.
3. The transition is taken: the exit actions of the mode, its own actions, the entry actions of its target.
4. From the target, only ``immediate`` transitions may be taken in the same reaction, as long as one is enabled.

``preemptive`` transitions come before all others.  If a mode has a refinement, they are checked before it fires; if one
is taken, it does not fire.  All other transitions are checked after it has fired.  If it fails, only ``error``
transitions are checked.

After entering a mode with a transition that is enabled without any token, the machine reacts again one microstep later.
A delay counts from the entry, even if a mode is entered again from itself.  In a final mode, nothing further happens.

Source: E. A. Lee and S. Tripakis, "Modal Models in Ptolemy" (2010); Ptolemy: ``FSMActor``.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, TypeVar

from ..core import Actor, EpicycleError, Fault, OutputPort, Parameter, ParameterError, Tag, Wake, did_you_mean

MOST_IMMEDIATE: Final = 1_000
_ROUNDING: Final = 1e-9  # of probabilities that add up to 1
ALL: Final = "*"

Method = Callable[[Any], None]
M = TypeVar("M", bound=Method)


@dataclass(frozen=True, eq=False)
class Rule:
    """One transition.

    ``guard``, ``delay``, ``probability`` and ``act`` are in the form that the modal actor uses; None means that there
    is none.
    """

    sources: tuple[str, ...]
    target: str
    on: tuple[str, ...] = ()
    guard: Any = None
    delay: Any = None
    probability: Any = None
    act: Any = None
    priority: int = 0
    otherwise: bool = False
    immediate: bool = False
    nondeterministic: bool = False
    preemptive: bool = False
    history: bool = False
    error: bool = False
    place: int = 0  # index among the transitions, for messages

    def __str__(self) -> str:
        return f"{', '.join(self.sources)} -> {self.target}"


class Chart:
    """The modes of a machine and the transitions that leave each; raises ``ParameterError`` if they do not fit."""

    def __init__(
        self, modes: Sequence[str], initial: str | None, final: Collection[str], rules: Sequence[Rule]
    ) -> None:
        if not modes:
            raise ParameterError("modes: expected at least one")
        self.modes = tuple(modes)
        self.initial = self._known("initial", modes[0] if initial is None else initial, "initial")
        self.final = frozenset(self._known("final", mode, "final") for mode in final)
        self.leaving: dict[str, tuple[Rule, ...]] = dict.fromkeys(modes, ())
        faults: list[Fault] = []
        for rule in rules:
            try:
                self._known(str(rule), rule.target, "transitions", rule.place)
                for mode in self._sources(rule):
                    self.leaving[mode] += (rule,)
            except ParameterError as error:
                faults += error.faults
        if faults:
            raise ParameterError.several(faults)
        self.immediate = self._those(lambda rule: rule.immediate)
        self.phases = self._those(lambda rule: rule.preemptive), self._those(lambda rule: not rule.preemptive)
        self._check_reach()
        for mode, leaving in self.leaving.items():
            self._check_clear(mode, leaving)

    def _those(self, of_a_kind: Callable[[Rule], bool]) -> dict[str, tuple[Rule, ...]]:
        return {mode: tuple(filter(of_a_kind, leaving)) for mode, leaving in self.leaving.items()}

    def _known(self, where: str, mode: str, *keys: str | int) -> str:
        if mode not in self.modes:
            near = did_you_mean(mode, self.modes)
            raise ParameterError(f"{where}: there is no mode {mode!r}{near}; modes: {', '.join(self.modes)}", keys)
        return mode

    def _sources(self, rule: Rule) -> list[str]:
        if rule.sources == (ALL,):
            return [mode for mode in self.modes if mode != rule.target and mode not in self.final]
        for mode in rule.sources:
            if self._known(str(rule), mode, "transitions", rule.place) in self.final:
                raise ParameterError(
                    f"{rule}: {mode!r} is final; no transition can leave it", ("transitions", rule.place)
                )
        return list(rule.sources)

    def _check_reach(self) -> None:
        reached, waiting = {self.initial}, [self.initial]
        while waiting:
            for rule in self.leaving[waiting.pop()]:
                if rule.target not in reached:
                    reached.add(rule.target)
                    waiting.append(rule.target)
        if lost := [mode for mode in self.modes if mode not in reached]:
            message = f"{lost[0]!r} is never entered: no transitions lead there from {self.initial!r}"
            raise ParameterError(message, ("modes", lost[0]), of_key=True)

    @staticmethod
    def _check_clear(mode: str, leaving: Sequence[Rule]) -> None:
        """Reject transitions that are certain to be enabled together with no preference between them."""
        seen: dict[object, Rule] = {}
        for rule in leaving:
            if rule.probability is not None:  # at most one of them is drawn
                continue
            same = (
                rule.priority, rule.otherwise, rule.on, rule.guard, rule.delay, rule.preemptive, rule.error
            )  # fmt: skip
            first = seen.setdefault(same, rule)
            if first is not rule and not (first.nondeterministic and rule.nondeterministic):
                raise ParameterError(
                    f"in {mode!r}, {first} and {rule} are always enabled together: give one a priority (the lower one "
                    "goes first), or make both nondeterministic",
                    ("transitions", rule.place),
                )


class ModalActor(Actor):
    """Base class of actors with modes whose transitions are methods:

    >>> class Door(ModalActor):
    ...     button = InputPort()
    ...     lamp = OutputPort(str)
    ...     modes = ("closed", "open")
    ...
    ...     @transition("closed", "open", on="button")
    ...     def opens(self) -> None:
    ...         self.lamp.send("green")
    ...
    ...     @transition("open", "closed", after=5.0)
    ...     def closes(self) -> None:
    ...         self.lamp.send("red")

    ``modes`` are their names; the first is the initial mode unless ``initial`` names another; ``final`` are those in
    which the actor is done.  The top of this file defines a reaction.
    """

    copies_share = ("_chart",)

    modes: Any = ()
    initial: Any = None
    final: Any = ()

    mode = OutputPort(str, doc="the mode, sent whenever one is entered")

    def check(self) -> None:
        methods = _methods(type(self)).items()
        found = [replace(rule, act=name) for name, each in methods for rule in getattr(each, "_transitions", ())]
        self._chart = Chart(self.modes, self.initial, self.final, found)
        for rule in found:
            for name in rule.on:
                if name not in self.inputs:
                    valid = ", ".join(self.inputs) or "none"
                    near = did_you_mean(name, self.inputs)
                    raise ParameterError(f"{rule}: there is no input {name!r}{near}; inputs: {valid}")

    # -- parts of a transition ------------------------------------------------------------------------------------

    def is_present(self, port: str) -> bool:
        """Whether an input has a token in this reaction."""
        return self.inputs[port].present

    def holds(self, rule: Rule) -> bool:
        """Whether the guard of a transition holds."""
        return rule.guard is None or bool(rule.guard(self))

    def delay_of(self, rule: Rule) -> float:
        """How long (s) after the entry a transition may be taken."""
        delay = rule.delay(self) if callable(rule.delay) else rule.delay
        return float(delay)

    def probability_of(self, rule: Rule) -> float:
        """The probability of a transition that would otherwise be enabled."""
        return float(rule.probability(self) if callable(rule.probability) else rule.probability)

    def act(self, rule: Rule) -> None:
        """The actions of a transition."""
        getattr(self, rule.act)()

    def moves(self, rule: Rule) -> None:
        """Apply what changes along with the mode."""

    def enters(self, mode: str) -> None:
        """The entry actions of a mode."""
        self._call("_entry_of", mode)

    def leaves(self, mode: str) -> None:
        """The exit actions of a mode."""
        self._call("_exit_of", mode)

    def commits(self) -> None:
        """Finish a reaction after all its transitions."""

    def goes_on(self) -> bool:
        """Whether it must react again at the next microstep without a token."""
        return any(self.holds_alone(each) for each in self._chart.leaving[self._current])

    def _call(self, mark: str, mode: str) -> None:
        for name, method in _methods(type(self)).items():
            if mode in getattr(method, mark, ()):
                getattr(self, name)()

    # -- the run --------------------------------------------------------------------------------------------------

    @property
    def current(self) -> str:
        """The current mode."""
        return self._current

    def initialize(self) -> None:
        self._current = self._chart.initial
        self._is_begun = False
        self._is_new = False  # whether it has entered a mode in this firing
        self._reacted: Tag | None = None  # tag of the latest transition
        self._timers: dict[Rule, Wake | None] = {}  # of delays; None after the end
        self._again: Wake | None = self.wake_in(0)  # wake-up for another reaction
        self._drawn: dict[Rule, bool] = {}  # in this firing, by transition with a probability
        self._number: float | None = None  # the random number for them, and the range used up
        self._used = 0.0
        self.error: str | None = None  # of the failed refinement of the mode

    def is_due(self, wake: Wake | None) -> bool:
        """Whether a wake-up is for this firing, or for an earlier one at this tag."""
        return wake is not None and (wake.due or wake.tag == self.tag)

    @property
    def is_called(self) -> bool:
        """Whether a delay ends now, or a reaction has requested another."""
        return self.is_due(self._again) or (bool(self._timers) and any(map(self.is_due, self._timers.values())))

    def fire(self) -> None:
        self.react(self._chart.phases)
        self.finish()

    def react(self, phases: Sequence[Mapping[str, Sequence[Rule]]]) -> None:
        """React, once per tag, with the first phase in which a transition is enabled."""
        chart = self._chart
        if not self._is_begun:
            self._is_begun = True
            self._enter(chart.initial)
            self.begins()
        elif self._reacted == self.tag:
            return
        rule = None
        for phase in phases:
            rule = rule or self._choose(phase[self._current])
        self.follow(rule)

    def begins(self) -> None:
        """Called when the first mode has been entered."""
        self._begin_delays()

    def follow(self, rule: Rule | None) -> None:
        """Take a transition, if there is one, and immediate ones after it."""
        taken = list[Rule]()
        while rule is not None:
            taken.append(rule)
            if len(taken) > MOST_IMMEDIATE:
                way = " -> ".join(dict.fromkeys(each.target for each in taken))
                raise EpicycleError(f"{MOST_IMMEDIATE:,} immediate transitions in one reaction: {way} -> ...")
            self._reacted = self.tag
            self._take(rule)
            rule = self._choose(self._chart.immediate[self._current])
        if taken:
            self.commits()
            self._begin_delays()

    def finish(self) -> None:
        """Send the new mode, and request another reaction if it can continue from there without a token."""
        if self._timers:
            self._timers = {rule: None if self.is_due(wake) else wake for rule, wake in self._timers.items()}
        if self._again is not None and self.is_due(self._again):
            self._again = None
        self._drawn, self._number = {}, None
        if self._is_new:
            self._is_new = False
            self.mode.send(self._current)
            if self.goes_on() and self._again is None:
                self._again = self.wake_in(0)

    def holds_alone(self, rule: Rule) -> bool:
        """Whether a transition would be enabled at the next microstep, if no token came."""
        return not (rule.otherwise or rule.on or rule.error) and self._is_open(rule) and self.holds(rule)

    def _is_open(self, rule: Rule) -> bool:
        """Whether the delay of a transition is over."""
        if rule.delay is None or rule not in self._timers:
            return rule.delay is None
        wake = self._timers[rule]
        return wake is None or self.is_due(wake)

    def _is_enabled(self, rule: Rule) -> bool:
        if rule.error != (self.error is not None) or (rule.delay is not None and not self._is_open(rule)):
            return False
        if rule.on and not any(map(self.is_present, rule.on)):
            return False
        return (rule.guard is None or self.holds(rule)) and (rule.probability is None or self._is_drawn(rule))

    def _is_drawn(self, rule: Rule) -> bool:
        """Whether the number drawn in this firing selects a transition; always true without a probability."""
        if rule.probability is None:
            return True
        if rule not in self._drawn:
            if self._number is None:
                self._number, self._used = self.random_stream("probability").random(), 0.0
            low, self._used = self._used, self._used + self.probability_of(rule)
            if self._used > 1.0 + _ROUNDING:
                raise EpicycleError(
                    f"in mode {self._current!r}, the probabilities of transitions that are enabled at once add up to "
                    f"{self._used:g}, more than 1"
                )
            high = self._used if self._used < 1.0 - _ROUNDING else 1.0
            self._drawn[rule] = low <= self._number < high
        return self._drawn[rule]

    def _choose(self, rules: Sequence[Rule]) -> Rule | None:
        if not rules:
            return None
        enabled = [rule for rule in rules if not rule.otherwise and self._is_enabled(rule)]
        enabled = enabled or [rule for rule in rules if rule.otherwise and self._is_enabled(rule)]
        if len(enabled) < 2:
            return enabled[0] if enabled else None
        first = min(rule.priority for rule in enabled)
        enabled = [rule for rule in enabled if rule.priority == first]
        if len(enabled) == 1:
            return enabled[0]
        if not all(rule.nondeterministic for rule in enabled):
            raise EpicycleError(
                f"in mode {self._current!r}, {' and '.join(map(str, enabled))} are enabled at once: give one a "
                "priority (the lower one goes first), or make all nondeterministic"
            )
        return enabled[self.random.below(len(enabled))]

    def _take(self, rule: Rule) -> None:
        self.leaves(self._current)
        if rule.act is not None:
            self.act(rule)
        self.error = None
        self.moves(rule)
        self._enter(rule.target)

    def _enter(self, mode: str) -> None:
        if self._timers:
            for wake in self._timers.values():
                if wake is not None:
                    wake.cancel()
            self._timers = {}
        self._drawn, self._number = {}, None
        self._current, self._is_new = mode, True
        self.enters(mode)

    def _begin_delays(self) -> None:
        leaving = self._chart.leaving[self._current]
        self._timers = {rule: self.wake_in(self.delay_of(rule)) for rule in leaving if rule.delay is not None}


# -- transitions as methods ---------------------------------------------------------------------------------------


def transition(
    source: str | Sequence[str],
    target: str,
    *,
    on: str | Sequence[str] = (),
    when: Callable[[Any], object] | None = None,
    after: float | str | Callable[[Any], float] | None = None,
    priority: int = 0,
    otherwise: bool = False,
    immediate: bool = False,
    nondeterministic: bool = False,
    preemptive: bool = False,
    probability: float | Callable[[Any], float] | None = None,
) -> Callable[[M], M]:
    """Declare a method of a ``ModalActor`` as the actions of a transition.

    ``source`` is a mode, several, or ``"*"`` for all but the target; ``on`` lists inputs of which one must have a
    token; ``when`` is a function of the actor that returns whether the transition can be taken; ``after`` is the time
    since the entry: s, a text with a unit, or a function of the actor.  ``probability`` is a number, or a function of
    the actor.  A method may serve several transitions.
    """
    delay = Parameter(float, unit="s", min=0).convert(after) if isinstance(after, (str, int, float)) else after
    rule = Rule(
        _texts(source), target, _texts(on), when, delay, probability, None,
        priority, otherwise, immediate, nondeterministic, preemptive,
    )  # fmt: skip

    def mark(method: M) -> M:
        vars(method).setdefault("_transitions", []).insert(0, rule)  # decorators apply from the bottom up
        return method

    return mark


def on_entry(*modes: str) -> Callable[[M], M]:
    """Declare a method of a ``ModalActor`` to be called whenever one of these modes is entered."""
    return _marked("_entry_of", modes)


def on_exit(*modes: str) -> Callable[[M], M]:
    """Declare a method of a ``ModalActor`` to be called whenever one of these modes is left."""
    return _marked("_exit_of", modes)


def _marked(mark: str, modes: tuple[str, ...]) -> Callable[[M], M]:
    def add(method: M) -> M:
        setattr(method, mark, modes)
        return method

    return add


def _methods(cls: type) -> dict[str, Any]:
    """The attributes of a class by name, those of its bases first."""
    names = dict.fromkeys(name for base in reversed(cls.__mro__) for name in vars(base))
    return {name: getattr(cls, name) for name in names if callable(getattr(cls, name, None))}


def _texts(given: str | Sequence[str]) -> tuple[str, ...]:
    return (given,) if isinstance(given, str) else tuple(given)
