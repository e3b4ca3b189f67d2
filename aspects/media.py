"""Media that ports share: what passes at one port is felt at the others."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Any

from epicycle.actors import Parameter

from .core import CommunicationAspect, JoinPoint
from .tokens import FieldError, field_of


class Medium(CommunicationAspect, ABC):
    """Base of media: what takes place at one port changes what takes place at the others.

    All ports of a declaration share one medium.  Several declarations of one type (in one composite) share it, too, if
    they give it the same name: that is how messages to different ports get different lengths.  A medium goes by the
    time of the model, for its ports may stand under different clocks.
    """

    medium: Parameter[str | None] = Parameter(
        str, None, doc="name of the medium, which declarations of the same type share; none: one of its own"
    )
    message_length = Parameter(float, 1.0, min=0.0, doc="length of a message, in the unit of the medium's speed")
    length_field: Parameter[str | None] = Parameter(
        str, None, doc="field of the message that holds its length, in place of message_length"
    )

    @abstractmethod
    def pass_token(self, token: Any, point: JoinPoint) -> None:
        """Decide what becomes of a token at a join point."""

    def length_of(self, token: Any) -> float:
        """The length of a message; raises ``FieldError``."""
        if self.length_field is None:
            return self.message_length
        length = field_of(token, self.length_field)
        if isinstance(length, bool) or not isinstance(length, (int, float)) or not 0.0 <= length < math.inf:
            raise FieldError(
                f"{type(token).__name__}.{self.length_field} is {length!r}, but the length of a message is a finite "
                f"number >= 0"
            )
        return float(length)
