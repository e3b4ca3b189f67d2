"""Random: a triggered source of random tokens."""

from __future__ import annotations

from .core import Actor, InputPort, OutputPort, Parameter
from .distributions import Distribution


class Random(Actor):
    """Sends a token drawn from ``distribution`` for each trigger, independent of all others.

    Ptolemy: ``Gaussian``, ``Uniform``, ``ColtExponential``, ``Bernoulli``, ``DiscreteRandomSource`` and others.
    """

    trigger = InputPort(doc="when to send")
    output = OutputPort(doc="the token drawn")

    distribution: Parameter[Distribution] = Parameter(Distribution, doc="what is drawn from")

    def check(self) -> None:
        self.output.type = self.distribution.token_type

    def fire(self) -> None:
        for _ in self.trigger.tokens:
            self.output.send(self.distribution.draw(self.random))
