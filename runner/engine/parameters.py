"""Parameters that change while the model runs: what aspects make of them whenever their actors fire."""

from __future__ import annotations

from typing import Any

import numpy as np

from epicycle.actors import Actor, Parameter, ParameterError


class VaryingParameter:
    """A parameter of an actor that aspects stand at; ``nominal`` is the value that the model gives it."""

    def __init__(self, actor: Actor, parameter: Parameter[Any]) -> None:
        self.actor = actor
        self.parameter = parameter
        self.nominal = parameter.value_in(actor)

    def set(self, value: Any) -> None:
        """Give it the value that comes behind the aspects; raises ``ParameterError`` if it does not take it."""
        if value is self.nominal:
            self.restore()
            return
        try:
            converted = self.parameter.convert(value.tolist() if isinstance(value, np.ndarray) else value)
        except ParameterError as error:
            raise ParameterError(
                f"{self.parameter.name} of {self.actor.path}: {error}; a Saturate behind keeps it within bounds"
            ) from None
        self.parameter.store(self.actor, converted)

    def restore(self) -> None:
        """Give it back the value that the model says."""
        self.parameter.store(self.actor, self.nominal)
