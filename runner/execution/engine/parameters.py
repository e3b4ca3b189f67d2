"""Parameters that change during a run: aspects compute them whenever their actors fire."""

from __future__ import annotations

from typing import Any

import numpy as np

from epicycle.actors import Actor, Parameter, ParameterError


class VaryingParameter:
    """A parameter of an actor with aspects; ``nominal`` is its value in the model."""

    def __init__(self, actor: Actor, parameter: Parameter[Any]) -> None:
        self.actor = actor
        self.parameter = parameter
        self.nominal = parameter.value_in(actor)

    def set(self, value: Any) -> None:
        """Set it to the value behind the aspects; raises ``ParameterError`` if the value is not valid."""
        if value is self.nominal:
            self.restore()
            return
        try:
            converted = self.parameter.convert(value.tolist() if isinstance(value, np.ndarray) else value)
        except ParameterError as error:
            raise ParameterError(
                f"{self.parameter.name} of {self.actor.path}: {error}; an aspect Saturate after the others keeps it "
                "within bounds"
            ) from None
        self.parameter.store(self.actor, converted)

    def restore(self) -> None:
        """Restore the value from the model."""
        self.parameter.store(self.actor, self.nominal)
