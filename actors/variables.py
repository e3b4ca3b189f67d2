"""Variables of a model, which change by events: Variable, SetVariable.

To use a variable, read its output ``value``: a ``PortParameter`` over a connection, any other parameter by an aspect
``Replace`` attached to it.  So each change has a tag and is in the log.
"""

from __future__ import annotations

from typing import Any

from .core import Actor, InputPort, OutputPort, Parameter, Pending, any_parameter


class Variable(Actor):
    """A value that may change: a token becomes its value at the next microstep, and is sent then.

    Of several tokens at one tag, the last is used.  Actors that fire at the tag of the change still see the old value,
    in any order; without ``delayed``, the new value takes effect at once.  Until a token comes, readers use the values
    given in the model.  Ptolemy: a ``Parameter`` that ``SetVariable`` sets.
    """

    input = InputPort(multi=True, doc="the value to set")
    value = OutputPort(depends_on=(), doc="the new value")

    delayed = Parameter(bool, True, doc="whether a new value takes effect at the next microstep, or at once")

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
    """Passes tokens to a ``Variable``, and sends the value of the variable at the tag of the change.

    That is the old value, which a ``Replace`` gives to the parameter ``value``; if the variable is not ``delayed``, it
    is the new one.  Several actors set one variable in the order of their firings.
    Ptolemy: ``SetVariable``.
    """

    input = InputPort(doc="the value to set")
    variable = OutputPort(doc="the same, for the variable")
    output = OutputPort(doc="value of the variable; nothing if unknown")

    value = any_parameter(None, doc="value of the variable")
    delayed = Parameter(bool, True, doc="whether the variable takes the new value at the next microstep")

    def fire(self) -> None:
        for token in self.input.tokens:
            self.variable.send(token)
            told = self.value if self.delayed else token
            if told is not None:
                self.output.send(told)
