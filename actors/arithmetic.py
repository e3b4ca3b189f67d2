"""Arithmetic on tokens: AddSubtract, MultiplyDivide, Extreme, Scale, MathFunction.

Integers stay integers where the result is one.  A result that is no real number (a division by zero, the root of a
negative number) ends the run with an error.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import reduce
from typing import Any, Final

from .core import (
    ABSENT,
    Actor,
    EpicycleError,
    InputPort,
    OutputPort,
    Parameter,
    PortParameter,
    elementary,
    present,
    rounds,
)


class AddSubtract(Actor):
    """The sum of the tokens at ``plus`` minus the sum of those at ``minus``.

    Channels without a token at this tag are ignored.  Ptolemy: ``AddSubtract``.
    """

    plus = InputPort(float, multi=True, required=False, doc="the numbers to add")
    minus = InputPort(float, multi=True, required=False, doc="the numbers to subtract")
    output = OutputPort(float, doc="sum(plus) - sum(minus)")

    def fire(self) -> None:
        for plus, minus in rounds(self.plus, self.minus):
            self.output.send(elementary.total(present(plus)) - elementary.total(present(minus)))


class MultiplyDivide(Actor):
    """The product of the tokens at ``multiply``, divided by each token at ``divide``.

    Channels without a token at this tag are ignored.  Ptolemy: ``MultiplyDivide``.
    """

    multiply = InputPort(float, multi=True, required=False, doc="the factors; without any, their product is 1")
    divide = InputPort(float, multi=True, required=False, doc="the divisors")
    output = OutputPort(float, doc="prod(multiply) / prod(divide)")

    def fire(self) -> None:
        for multiply, divide in rounds(self.multiply, self.divide):
            self.output.send(reduce(self.divided, present(divide), math.prod(present(multiply))))

    def divided(self, product: Any, divisor: Any) -> Any:
        """The quotient of two numbers."""
        if divisor == 0:
            raise EpicycleError(f"{product!r} cannot be divided by {divisor!r}")
        return product / divisor


class Extreme(Actor):
    """The largest or smallest of the tokens that come together, and its channel; of equal ones, the first.

    Channels without a token at this tag are ignored.  Ptolemy: ``Maximum`` (``maximumValue``, ``channelNumber``),
    ``Minimum``.
    """

    input = InputPort(float, multi=True, doc="the numbers to compare")
    value = OutputPort(float, doc="the largest or smallest number")
    channel = OutputPort(int, doc="the channel on which it came, from 0")

    take = Parameter(str, choices=("greatest", "least"), doc="which of the two")

    def fire(self) -> None:
        for (tokens,) in rounds(self.input):
            there = [channel for channel, token in enumerate(tokens) if token is not ABSENT]
            if any(_is_nan(tokens[channel]) for channel in there):
                raise EpicycleError("nan is neither greater nor less than a number")
            best = max if self.take == "greatest" else min
            channel = best(there, key=tokens.__getitem__)
            self.value.send(tokens[channel])
            self.channel.send(channel)


class Scale(Actor):
    """Multiplies each token: ``factor * input + offset``.

    Ptolemy: ``Scale``, ``AddSubtract`` with a constant.
    """

    input = InputPort(float, doc="the numbers to multiply")
    output = OutputPort(float, doc="factor * input + offset")

    factor = PortParameter(int | float, 1, doc="what each token is multiplied by")
    offset = PortParameter(int | float, 0, doc="what is added to the product")

    def fire(self) -> None:
        for token in self.input.tokens:
            self.output.send(self.factor * token + self.offset)


def _is_nan(x: Any) -> bool:
    return isinstance(x, float) and math.isnan(x)


def _sign(x: float) -> int:
    if _is_nan(x):
        raise ValueError
    return (x > 0) - (x < 0)


FUNCTIONS: Final[dict[str, Callable[[Any], Any]]] = {
    "abs": abs,
    "negate": lambda x: -x,
    "sign": _sign,
    "square": lambda x: elementary.power(x, 2),
    "sqrt": math.sqrt,
    "exp": elementary.exp,
    "log": elementary.log,
    "log10": elementary.log10,
    "sin": elementary.sin,
    "cos": elementary.cos,
    "tan": elementary.tan,
    "asin": elementary.asin,
    "acos": elementary.acos,
    "atan": elementary.atan,
    "floor": math.floor,
    "ceil": math.ceil,
    "round": round,  # to the even neighbour, as Python does
}


class MathFunction(Actor):
    """A common function of one number; angles are in rad.

    Ptolemy: ``AbsoluteValue``, ``MathFunction``, ``TrigFunction``, ``Round``.
    """

    input = InputPort(float, doc="the argument")
    output = OutputPort(float, doc="the value of the function")

    function = Parameter(str, choices=tuple(FUNCTIONS), doc="which function")

    def fire(self) -> None:
        function = FUNCTIONS[self.function]
        for token in self.input.tokens:
            try:
                self.output.send(function(token))
            except (ValueError, OverflowError):
                raise EpicycleError(f"{self.function} of {token!r} is not a real number, or is too large") from None
