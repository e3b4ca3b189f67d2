"""StateMachine as in Ptolemy: ``FSMActor``."""

from __future__ import annotations

from epicycle import actors

from .changing import Waiting


class StateMachine(actors.StateMachine):
    """A machine that takes one token of each channel per firing, and fires again at the same tag for the rest.

    It reacts again one microstep after each transition, which ``else`` can take; immediate transitions of its first
    mode come before all others.  Variables are set when all transitions of a reaction have sent, so that guards and
    outputs use the values from before.
    """

    def initialize(self) -> None:
        super().initialize()
        self._waiting = Waiting([self.inputs[name] for name in self._inputs])
        self._unset: list[tuple[str, actors.expression.Formula]] = []  # variables that will be set

    def fire(self) -> None:
        for _ in self._waiting.firings():
            super().fire()
            self.trigger.clear()

    def take_tokens(self) -> None:
        self._waiting.come()
        for name in self._inputs:
            if name not in self._tokens and (found := self._waiting.firsts(self.inputs[name])[0]):
                self._tokens[name] = found[-1]

    def rests(self) -> None:
        self._reacted, self._has_changed = None, False

    def sets(self, name: str, formula: actors.expression.Formula) -> None:
        self._unset.append((name, formula))

    def begins(self) -> None:
        self.commits()
        self.follow(self._choose(self._exits.immediate))
        self._reacted = None
        super().begins()

    def commits(self) -> None:
        if self._unset:
            for name, formula in self._unset:
                super().sets(name, formula)
            self._unset = []
            self._enter_borders(self._current)

    def goes_on(self) -> bool:
        return self._reacted is not None and self._current not in self._chart.final
