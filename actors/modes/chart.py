"""The modes of a machine, and the transitions that lead from one to another."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any, Final

from ..core import Fault, ParameterError, did_you_mean

ALL: Final = "*"


@dataclass(frozen=True, eq=False)
class Rule:
    """One transition.

    ``guard``, ``delay``, ``probability``, ``rate`` and ``act`` are in the form that the modal actor uses; None
    means that there is none.
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
    rate: Any = None
    place: int = 0  # index among the transitions, for messages

    def __str__(self) -> str:
        return f"{', '.join(self.sources)} -> {self.target}"


Leaving = tuple[tuple[Rule, ...], ...]  # transitions, those of a later part only if none of the earlier ones is enabled


@dataclass(frozen=True, slots=True)
class Exits:
    """The transitions that leave a mode, by the occasion on which they are looked at."""

    preemptive: Leaving
    others: Leaving
    immediate: Leaving
    delayed: tuple[Rule, ...]
    racing: tuple[Rule, ...]
    alone: tuple[Rule, ...]  # that need neither a token nor a time

    @classmethod
    def of(cls, rules: Sequence[Rule]) -> Exits:
        """Those among the transitions that leave one mode."""

        def those(of_a_kind: Callable[[Rule], bool]) -> tuple[Rule, ...]:
            return tuple(filter(of_a_kind, rules))

        def apart(found: tuple[Rule, ...]) -> Leaving:
            parts = (tuple(each for each in found if each.otherwise is late) for late in (False, True))
            return tuple(filter(None, parts))

        return cls(
            preemptive=apart(those(lambda rule: rule.preemptive)),
            others=apart(those(lambda rule: not rule.preemptive and rule.rate is None)),
            immediate=apart(those(lambda rule: rule.immediate)),
            delayed=those(lambda rule: rule.delay is not None),
            racing=those(lambda rule: rule.rate is not None),
            alone=those(
                lambda rule: not (rule.otherwise or rule.on or rule.error) and rule.rate is None and rule.delay is None
            ),
        )


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
                _check_race(rule)
                self._known(str(rule), rule.target, "transitions", rule.place)
                for mode in self._sources(rule):
                    self.leaving[mode] += (rule,)
            except ParameterError as error:
                faults += error.faults
        if faults:
            raise ParameterError.several(faults)
        self.exits = {mode: Exits.of(leaving) for mode, leaving in self.leaving.items()}
        self._check_reach()
        for mode, leaving in self.leaving.items():
            self._check_clear(mode, leaving)

    def _known(self, where: str, mode: str, *keys: str | int) -> str:
        if mode not in self.modes:
            near = did_you_mean(mode, self.modes) or ";"
            raise ParameterError(f"{where}: there is no mode {mode!r}{near} modes: {', '.join(self.modes)}", keys)
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
            if rule.probability is not None or rule.rate is not None:  # at most one of them is drawn
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


def _check_race(rule: Rule) -> None:
    """Reject what a transition with a rate, which waits for its own time, cannot have besides."""
    if rule.rate is None:
        return
    others = {
        "on": rule.on, "after": rule.delay, "probability": rule.probability, "priority": rule.priority,
        "else": rule.otherwise, "immediate": rule.immediate, "nondeterministic": rule.nondeterministic,
        "preemptive": rule.preemptive, "error": rule.error,
    }  # fmt: skip
    for name, given in others.items():
        if given is not None and given is not False and given not in ((), 0):
            raise ParameterError(
                f"{rule}: a transition with a rate comes at a time of its own, without {name!r}",
                ("transitions", rule.place),
            )
