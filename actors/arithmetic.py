"""Arithmetic on tokens: AddSubtract, MultiplyDivide, Extreme, Scale, MathFunction.

Integers stay integers where the result is one.  A result that is no real number (a division by zero, the root of a
negative number) ends the run with an error.
"""

from __future__ import annotations

import math
import operator
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
from .items import added as _added
from .items import item_by_item as _item_by_item
from .items import less as _less


class AddSubtract(Actor):
    """The sum of the tokens at ``plus`` minus the sum of those at ``minus``.

    Channels without a token at this tag are ignored.  Under ``like: ptolemy``, the ports also take other tokens: texts
    are joined, lists are added item by item, and records field by field.  Ptolemy: ``AddSubtract``.
    """

    plus = InputPort(float, multi=True, required=False, ptolemy={"type": Any}, doc="the numbers to add")
    minus = InputPort(float, multi=True, required=False, ptolemy={"type": Any}, doc="the numbers to subtract")
    output = OutputPort(float, ptolemy={"type": Any}, doc="sum(plus) - sum(minus)")

    def fire(self) -> None:
        for plus, minus in rounds(self.plus, self.minus):
            above, below = present(plus), present(minus)
            if self.output.type is float or all(isinstance(token, (int, float)) for token in above + below):
                self.output.send(elementary.total(above) - elementary.total(below))
            else:
                self.output.send(reduce(_less, below, reduce(_added, above[1:], above[0] if above else 0)))


class MultiplyDivide(Actor):
    """The product of the tokens at ``multiply``, divided by each token at ``divide``.

    Channels without a token at this tag are ignored.  With ``whole``, as in Ptolemy, quotients of whole numbers are
    rounded towards zero, and lists are multiplied item by item.  Ptolemy: ``MultiplyDivide``.
    """

    multiply = InputPort(
        float,
        multi=True,
        required=False,
        ptolemy={"type": Any},
        doc="the factors; without any, their product is 1",
    )
    divide = InputPort(float, multi=True, required=False, ptolemy={"type": Any}, doc="the divisors")
    output = OutputPort(float, ptolemy={"type": Any}, doc="prod(multiply) / prod(divide)")

    whole = Parameter(
        bool, False, ptolemy=True, doc="whether a quotient of whole numbers is rounded to a whole number, towards zero"
    )

    def fire(self) -> None:
        for multiply, divide in rounds(self.multiply, self.divide):
            factors, divisors = present(multiply), present(divide)
            if all(isinstance(each, (int, float)) for each in factors + divisors):
                self.output.send(reduce(self._divided, divisors, math.prod(factors)))
            else:
                product = reduce(lambda one, other: _item_by_item(one, other, operator.mul), factors) if factors else 1
                self.output.send(reduce(lambda one, other: _item_by_item(one, other, self._divided), divisors, product))

    def _divided(self, product: Any, divisor: Any) -> Any:
        if divisor == 0:
            raise EpicycleError(f"{product!r} cannot be divided by {divisor!r}")
        if self.whole and isinstance(product, int) and isinstance(divisor, int):
            sign = 1 if (product < 0) == (divisor < 0) else -1
            return sign * (abs(product) // abs(divisor))
        return product / divisor


class Extreme(Actor):
    """The largest or smallest of the tokens that come together, and its channel; of equal ones, the first.

    Channels without a token at this tag are ignored.  Ptolemy: ``Maximum`` (``maximumValue``, ``channelNumber``),
    ``Minimum``.
    """

    input = InputPort(float, multi=True, doc="the numbers to compare")
    value = OutputPort(float, ptolemy={"type": Any}, doc="the largest or smallest number")
    channel = OutputPort(int, doc="the channel on which it came, from 0")

    take = Parameter(str, choices=("greatest", "least"), doc="which of the two")

    def fire(self) -> None:
        for (tokens,) in rounds(self.input):
            there = [channel for channel, token in enumerate(tokens) if token is not ABSENT]
            best = max if self.take == "greatest" else min
            channel = best(there, key=tokens.__getitem__)
            self.value.send(tokens[channel])
            self.channel.send(channel)


class Scale(Actor):
    """Multiplies each token: ``factor * input + offset``; under ``like: ptolemy`` also each item of a list.

    Ptolemy: ``Scale``, ``AddSubtract`` with a constant.
    """

    input: InputPort[Any] = InputPort(float, ptolemy={"type": Any}, doc="the numbers to multiply")
    output = OutputPort(float, ptolemy={"type": Any}, doc="factor * input + offset")

    factor: PortParameter[float] = PortParameter(int | float, 1, doc="what each token is multiplied by")
    offset: PortParameter[float] = PortParameter(int | float, 0, doc="what is added to the product")

    def fire(self) -> None:
        for token in self.input.tokens:
            if self.output.type is float or isinstance(token, (int, float)):
                self.output.send(self.factor * token + self.offset)
            else:
                scaled = _item_by_item(token, self.factor, operator.mul)
                self.output.send(scaled if self.offset == 0 else _added(scaled, self.offset))


def _sign(x: float) -> int:
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
    output = OutputPort(float, ptolemy={"type": Any}, doc="the value of the function")

    function = Parameter(str, choices=tuple(FUNCTIONS), doc="which function")

    def fire(self) -> None:
        function = FUNCTIONS[self.function]
        for token in self.input.tokens:
            try:
                self.output.send(function(token))
            except (ValueError, OverflowError):
                raise EpicycleError(f"{self.function} of {token!r} is not a real number, or is too large") from None
