"""Random: a triggered source of random tokens."""

from __future__ import annotations

from typing import Any

from .core import Actor, InputPort, OutputPort, Parameter
from .distributions import Distribution


class Random(Actor):
    """Sends a token drawn from ``distribution`` for each trigger, independent of all others.

    Ptolemy: ``Gaussian``, ``Uniform``, ``ColtExponential``, ``Bernoulli``, ``DiscreteRandomSource`` and others.
    """

    trigger: InputPort[Any] = InputPort(Any, doc="when to send")
    output: OutputPort[Any] = OutputPort(Any, doc="the token drawn")

    distribution: Parameter[Distribution] = Parameter(Distribution, doc="what is drawn from")

    def __init__(self, path: str, **parameters: object) -> None:
        super().__init__(path, **parameters)
        self.output.type = self.distribution.token_type

    def fire(self) -> None:
        for _ in self.trigger.tokens:
            self.output.send(self.distribution.draw(self.random))
