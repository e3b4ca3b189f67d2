"""Modal actors: the meaning of modes and transitions, in models and in Python.

The meaning
-----------
A machine is in one mode.  It reacts once per tag at which it fires:

1. A transition that leaves the mode is *enabled* if its delay is over, one of its trigger ports has a token, and its
   guard holds.  An ``otherwise`` transition is enabled if no other one is.  Of the transitions with a ``probability``,
   one is drawn: their probabilities divide the range from 0 to 1, one after the other.  Transitions with a ``rate``
   race: each whose guard holds comes after an exponentially distributed time of its own, and the first is taken if
   nothing else is enabled.
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

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import fsum
from typing import Any, ClassVar, Final, TypeVar

from ..core import Actor, EpicycleError, OutputPort, Parameter, ParameterError, Tag, Wake, did_you_mean
from .chart import Chart, Leaving, Rule

MOST_IMMEDIATE: Final = 1_000
_ROUNDING: Final = 1e-9  # of probabilities that add up to 1

Method = Callable[[Any], None]
M = TypeVar("M", bound=Method)


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

    copies_share: ClassVar[tuple[str, ...]] = ("_chart", "_exits")

    modes: Any = ()
    initial: Any = None
    final: Any = ()

    mode = OutputPort(str, doc="the mode, sent whenever one is entered")

    def check(self) -> None:
        methods = _methods(type(self)).items()
        found = [replace(rule, act=name) for name, each in methods for rule in getattr(each, "_transitions", ())]
        self._chart = Chart(self.modes, self.initial, self.final, found)
        self._calls = {
            (mark, mode): [name for name, each in methods if mode in getattr(each, mark, ())]
            for mark in ("_entry_of", "_exit_of")
            for mode in self.modes
        }
        for rule in found:
            for name in rule.on:
                if name not in self.inputs:
                    valid = ", ".join(self.inputs) or "none"
                    near = did_you_mean(name, self.inputs)
                    raise ParameterError(f"{rule}: there is no input {name!r}{near or ';'} inputs: {valid}")

    # -- parts of a transition ------------------------------------------------------------------------------------

    def is_present(self, port: str) -> bool:
        """Whether an input has a token in this reaction."""
        return self.inputs[port].present

    def hears(self, rule: Rule) -> bool:
        """Whether one of the inputs of a transition has a token in this reaction."""
        return any(map(self.is_present, rule.on))

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

    def rate_of(self, rule: Rule) -> float:
        """How often (1/s) a transition comes while its guard holds."""
        return float(rule.rate(self) if callable(rule.rate) else rule.rate)

    def enters(self, mode: str) -> None:
        """The entry actions of a mode."""
        for name in self._calls["_entry_of", mode]:
            getattr(self, name)()

    def leaves(self, mode: str) -> None:
        """The exit actions of a mode."""
        for name in self._calls["_exit_of", mode]:
            getattr(self, name)()

    def commits(self) -> None:
        """Finish a reaction after all its transitions."""

    def goes_on(self) -> bool:
        """Whether it must react again at the next microstep without a token."""
        return any(map(self.holds, self._exits.alone))

    # -- the run --------------------------------------------------------------------------------------------------

    @property
    def current(self) -> str:
        """The current mode."""
        return self._current

    def initialize(self) -> None:
        self._current = self._chart.initial
        self._exits = self._chart.exits[self._current]
        self._is_begun = False
        self._is_new = False  # whether it has entered a mode in this firing
        self._reacted: Tag | None = None  # tag of the latest transition
        self._timers: dict[Rule, Wake | None] = {}  # of delays; None after the end
        self._again: Wake | None = self.wake_in(0)  # wake-up for another reaction
        self._number: float | None = None  # drawn in this firing for transitions with a probability
        self._used = 0.0  # of the range from 0 to 1
        self._drawn: dict[Rule, bool] = {}  # which of them it selects
        self._rates: dict[Rule, float] = {}  # of the transitions that race, and when the first one comes
        self._first: Wake | None = None
        self.error: str | None = None  # of the failed refinement of the mode

    def is_due(self, wake: Wake | None) -> bool:
        """Whether a wake-up is for this firing, or for an earlier one at this tag."""
        return wake is not None and (wake.due or (wake.time == self.context.time and wake.tag == self.tag))

    @property
    def is_called(self) -> bool:
        """Whether a delay ends now, a race is over, or a reaction has requested another."""
        for wake in (self._again, self._first, *self._timers.values()):
            if wake is not None and self.is_due(wake):
                return True
        return False

    def fire(self) -> None:
        self.react()
        self.finish()

    def react(self, *, preempts: bool = False) -> None:
        """React, once per tag; while it ``preempts``, only preemptive transitions can be taken."""
        if not self._is_begun:
            self._is_begun = True
            self._enter(self._chart.initial)
            self.begins()
        elif self._reacted == self.context.tag:
            return
        exits = self._exits
        rule = self._choose(exits.preemptive) if exits.preemptive else None
        if rule is None and not preempts:
            rule = self._choose(exits.others)
            if rule is None and self._first is not None and self.error is None and self.is_due(self._first):
                rule = self._winner()
        if rule is not None:
            self.follow(rule)

    def begins(self) -> None:
        """Called when the first mode has been entered."""
        self._begin_delays()

    def follow(self, rule: Rule | None) -> None:
        """Take a transition, if there is one, and immediate ones after it."""
        taken: list[Rule] = []
        while rule is not None:
            taken.append(rule)
            if len(taken) > MOST_IMMEDIATE:
                way = " -> ".join(dict.fromkeys(each.target for each in taken))
                raise EpicycleError(f"{MOST_IMMEDIATE:,} immediate transitions in one reaction: {way} -> ...")
            self._reacted = self.context.tag
            self._take(rule)
            immediate = self._exits.immediate
            rule = self._choose(immediate) if immediate else None
        if taken:
            self.commits()
            self._begin_delays()

    def finish(self) -> None:
        """Send the new mode, and request another reaction if it can continue from there without a token."""
        for rule, wake in self._timers.items():
            if wake is not None and self.is_due(wake):
                self._timers[rule] = None
        if self._again is not None and self.is_due(self._again):
            self._again = None
        self._number = None
        if self._rates or self._exits.racing:
            self.race()
        if self._is_new:
            self._is_new = False
            self.mode.send(self._current)
            if self.goes_on() and self._again is None:
                self._again = self.wake_in(0)

    def race(self) -> None:
        """Draw when the first of the transitions with rates comes, if that is open: rates have no memory."""
        rates = {rule: self.rate_of(rule) for rule in self._exits.racing if self.holds(rule)}
        if rates == self._rates and not self._is_new and not self.is_due(self._first):
            return
        if self._first is not None:
            self._first.cancel()
        self._rates, self._first, total = rates, None, fsum(rates.values())
        if total > 0.0:
            self._first = self.wake_in(self.random_stream("rate").exponential(1.0 / total))

    def _winner(self) -> Rule:
        """The transition that wins the race, which is over now."""
        place = self.random_stream("rate").random() * fsum(self._rates.values())
        for rule, rate in self._rates.items():
            place -= rate
            if place < 0.0:
                return rule
        return max(self._rates, key=self._rates.__getitem__)  # where rounding has left something over

    def _is_open(self, rule: Rule) -> bool:
        """Whether the delay of a transition is over."""
        if rule.delay is None or rule not in self._timers:
            return rule.delay is None
        wake = self._timers[rule]
        return wake is None or self.is_due(wake)

    def _is_enabled(self, rule: Rule) -> bool:
        if rule.error != (self.error is not None) or (rule.delay is not None and not self._is_open(rule)):
            return False
        if rule.on and not self.hears(rule):
            return False
        return (rule.guard is None or self.holds(rule)) and (rule.probability is None or self._is_drawn(rule))

    def _is_drawn(self, rule: Rule) -> bool:
        """Whether the number drawn in this firing selects a transition; always true without a probability."""
        if rule.probability is None:
            return True
        if self._number is None:
            self._number, self._used, self._drawn = self.random_stream("probability").random(), 0.0, {}
        if rule not in self._drawn:
            low, self._used = self._used, self._used + self.probability_of(rule)
            if self._used > 1.0 + _ROUNDING:
                raise EpicycleError(
                    f"in mode {self._current!r}, the probabilities of transitions that are enabled at once add up to "
                    f"{self._used:g}, more than 1"
                )
            high = self._used if self._used < 1.0 - _ROUNDING else 1.0
            self._drawn[rule] = low <= self._number < high
        return self._drawn[rule]

    def _choose(self, rules: Leaving) -> Rule | None:
        for those in rules:
            if enabled := [rule for rule in those if self._is_enabled(rule)]:
                break
        else:
            return None
        if len(enabled) == 1:
            return enabled[0]
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
        getattr(self, rule.act)()
        self.error = None
        self._enter(rule.target)

    def _enter(self, mode: str) -> None:
        if self._timers:
            for wake in self._timers.values():
                if wake is not None:
                    wake.cancel()
            self._timers = {}
        self._number = None
        self._current, self._exits, self._is_new = mode, self._chart.exits[mode], True
        self.enters(mode)

    def _begin_delays(self) -> None:
        if delayed := self._exits.delayed:
            self._timers = {rule: self.wake_in(self.delay_of(rule)) for rule in delayed}


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
    rate: float | Callable[[Any], float] | None = None,
) -> Callable[[M], M]:
    """Declare a method of a ``ModalActor`` as the actions of a transition.

    ``source`` is a mode, several, or ``"*"`` for all but the target; ``on`` lists inputs of which one must have a
    token; ``when`` is a function of the actor that returns whether the transition can be taken; ``after`` is the time
    since the entry: s, a text with a unit, or a function of the actor.  ``probability`` and ``rate`` (1/s) are numbers,
    or functions of the actor.  A method may serve several transitions.
    """
    delay = Parameter(float, unit="s", min=0).convert(after) if isinstance(after, (str, int, float)) else after
    rule = Rule(
        _texts(source), target, _texts(on), when, delay, probability, None,
        priority, otherwise, immediate, nondeterministic, preemptive, rate=rate,
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
