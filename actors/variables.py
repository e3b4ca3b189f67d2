"""Variables of a model, which change by events: Variable, SetVariable.

Whatever is to go by one reads its output ``value``: a ``PortParameter`` over a connection, any other parameter by an
aspect ``Replace`` that stands there.  So each change has a tag, and is in the log.
"""

from __future__ import annotations

from typing import Any

from .core import Actor, InputPort, OutputPort, Parameter, Pending


class Variable(Actor):
    """A value that may change: the latest token is its value from the next microstep on, and is sent then.

    Of tokens that come at one tag, the last counts.  Whoever fires at the tag at which it is set still finds the value
    before, in whatever order; without ``delayed`` the new one counts at once.  Until something comes, who reads it goes
    by what the model gives.  Ptolemy: a ``Parameter`` that ``SetVariable`` sets.
    """

    input = InputPort(multi=True, doc="what it is set to")
    value = OutputPort(depends_on=(), doc="the new value")

    delayed = Parameter(bool, True, doc="whether a new value counts from the next microstep on, or at once")

    def check(self) -> None:
        self.value.depends_on = () if self.delayed else ("input",)

    def initialize(self) -> None:
        self._next: Pending[Any] = Pending(self)

    def fire(self) -> None:
        for value in self._next.due():
            self.value.send(value)
        if self.input.present and self.delayed:
            self._next.put(self.input.value, 0)
        elif self.input.present:
            self.value.send(self.input.value)


class SetVariable(Actor):
    """Hands what comes to a ``Variable``, and tells what this is worth at the tag of the setting.

    That is the value before, which a ``Replace`` gives to the parameter ``value``; if the variable is not ``delayed``,
    it is the new one.  Where several set one variable, they do so in the order in which they fire.
    Ptolemy: ``SetVariable``.
    """

    input = InputPort(doc="what the variable is set to")
    variable = OutputPort(doc="the same, for the variable")
    output = OutputPort(doc="what the variable is worth; nothing if that is not known")

    value: Parameter[Any] = Parameter(object, None, doc="what the variable is worth")
    delayed = Parameter(bool, True, doc="whether the variable is worth what it is set to from the next microstep on")

    def fire(self) -> None:
        for token in self.input.tokens:
            self.variable.send(token)
            told = self.value if self.delayed else token
            if told is not None:
                self.output.send(told)
