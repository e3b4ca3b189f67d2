"""Actors that compute: in Ptolemy they take tokens of any type, and each token once."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping
from functools import partial, reduce
from typing import Any

from epicycle import actors
from epicycle.actors import Actor, EpicycleError, InputPort, OutputPort, counted, present, rounds
from epicycle.actors.expression import operand, text_of

from .changing import Singly, Together, but, preset


def _of_any_type(kind: type[Actor], *outputs: str) -> type[Actor]:
    """An actor some of whose outputs send tokens of any type."""
    body = {name: but(getattr(kind, name), type=Any) for name in outputs}
    return type(kind.__name__, (kind,), {"__doc__": kind.__doc__, "__module__": __name__, **body})


Difference = _of_any_type(actors.Difference, "output")
Extreme = _of_any_type(actors.Extreme, "value")
MathFunction = _of_any_type(actors.MathFunction, "output")
MovingAverage = _of_any_type(actors.MovingAverage, "output")
MovingStatistics = _of_any_type(actors.MovingStatistics, "min", "max")


def _are_numbers(tokens: list[Any]) -> bool:
    return all(isinstance(each, (int, float)) for each in tokens)


def added(left: Any, right: Any) -> Any:
    """The sum; if one side is a text, both are joined as texts."""
    if isinstance(left, str) or isinstance(right, str):
        return text_of(left) + text_of(right)
    return item_by_item(left, right, operator.add)


def less(left: Any, right: Any) -> Any:
    """The difference."""
    return item_by_item(left, right, operator.sub)


def item_by_item(left: Any, right: Any, compute: Callable[[Any, Any], Any]) -> Any:
    """A sum or similar of numbers, of lists of them, or of fields that both sides have; a number is combined with each
    item of a list."""
    left, right = operand(left), operand(right)
    if isinstance(left, Mapping) and isinstance(right, Mapping):
        return {name: item_by_item(left[name], right[name], compute) for name in left if name in right}
    lists = [isinstance(each, (list, tuple)) for each in (left, right)]
    if any(lists) and not any(isinstance(each, (str, Mapping)) for each in (left, right)):
        if all(lists) and len(left) != len(right):
            raise EpicycleError(f"{left!r} has {counted(len(left), 'item')}, but {right!r} has {len(right)}")
        count = len(left if lists[0] else right)
        pairs = zip(left if lists[0] else [left] * count, right if lists[1] else [right] * count, strict=True)
        return [item_by_item(one, other, compute) for one, other in pairs]
    if not isinstance(left, (int, float)) or not isinstance(right, (int, float)):
        raise EpicycleError(f"{left!r} and {right!r} cannot be combined")
    return compute(left, right)


class AddSubtract(actors.AddSubtract):
    """The sum of the tokens at ``plus`` minus those at ``minus``: texts are joined, lists added item by item."""

    plus: InputPort[Any] = but(actors.AddSubtract.plus, type=Any)
    minus: InputPort[Any] = but(actors.AddSubtract.minus, type=Any)
    output: OutputPort[Any] = but(actors.AddSubtract.output, type=Any)

    def fire(self) -> None:
        for plus, minus in rounds(self.plus, self.minus):
            above, below = present(plus), present(minus)
            if _are_numbers(above + below):
                self.output.send(actors.elementary.total(above) - actors.elementary.total(below))
            else:
                self.output.send(reduce(less, below, reduce(added, above[1:], above[0] if above else 0)))


class MultiplyDivide(actors.MultiplyDivide):
    """The product of the tokens at ``multiply``, divided by those at ``divide``; lists item by item.

    The quotient of whole numbers is rounded towards zero.
    """

    multiply: InputPort[Any] = but(actors.MultiplyDivide.multiply, type=Any)
    divide: InputPort[Any] = but(actors.MultiplyDivide.divide, type=Any)
    output: OutputPort[Any] = but(actors.MultiplyDivide.output, type=Any)

    def fire(self) -> None:
        for multiply, divide in rounds(self.multiply, self.divide):
            factors, divisors = present(multiply), present(divide)
            product = reduce(partial(item_by_item, compute=operator.mul), factors) if factors else 1
            self.output.send(reduce(partial(item_by_item, compute=self.divided), divisors, product))

    def divided(self, product: Any, divisor: Any) -> Any:
        if not isinstance(product, int) or not isinstance(divisor, int) or divisor == 0:
            return super().divided(product, divisor)
        sign = 1 if (product < 0) == (divisor < 0) else -1
        return sign * (abs(product) // abs(divisor))


class Scale(actors.Scale):
    """Multiplies each token, or each item of a list: ``factor * input + offset``."""

    input: InputPort[Any] = but(actors.Scale.input, type=Any)
    output: OutputPort[Any] = but(actors.Scale.output, type=Any)

    def fire(self) -> None:
        for token in self.input.tokens:
            if isinstance(token, (int, float)):
                self.output.send(self.factor * token + self.offset)
            else:
                scaled = item_by_item(token, self.factor, operator.mul)
                self.output.send(scaled if self.offset == 0 else added(scaled, self.offset))


class Accumulator(actors.Accumulator):
    """The sum of all tokens so far; lists are added item by item, and only true tokens reset it."""

    input: InputPort[Any] = but(actors.Accumulator.input, type=Any)
    output: OutputPort[Any] = but(actors.Accumulator.output, type=Any)

    reset_by = preset(actors.Accumulator.reset_by, "true")

    def add(self, tokens: list[Any]) -> None:
        if _are_numbers([self._sum, *tokens]):
            super().add(tokens)
        else:
            self._sum = reduce(added, tokens, self._sum)


class Comparator(Together, actors.Comparator):
    """Compares the k-th token at ``left`` with the k-th at ``right``."""


class Expression(Together, actors.Expression):
    """Evaluates an expression over the k-th tokens of all inputs together; its value may be of any type."""

    gives = preset(actors.Expression.gives, "any value")


class HoldingExpression(Together, actors.HoldingExpression):
    """Evaluates an expression over held values and the k-th tokens of the other inputs together."""

    def waited_for(self) -> list[InputPort[Any]]:
        return [port for port in self._ports if port.name in self._needed]

    def fire(self) -> None:
        for port in self._ports if self._needed else ():
            if port.name not in self._needed and port.present:
                port.give((port.take()[0][-1:], [0]))
        super().fire()


class Counter(Singly, actors.Counter):
    """Counts the first tokens of all channels, then the second ones, and so on; a true token then resets it."""

    reset_by = preset(actors.Counter.reset_by, "true")

    def fire_once(self) -> None:
        if any(token is True or self.reset_by == "any" for token in self.reset.tokens):
            self.increment.clear()
            self.decrement.clear()
        super().fire_once()


class Default(actors.Default):
    """Passes on the tokens at ``preferred``, and then those at ``alternate``, at the same tag."""

    output: OutputPort[Any] = but(actors.Default.output, depends_on=("preferred",))

    def fire(self) -> None:
        for token in (*self.preferred.tokens, *self.alternate.tokens):
            self.output.send(token)


class LookupTable(actors.LookupTable):
    """Looks a number up in a table; nothing is sent for one outside."""

    outside = preset(actors.LookupTable.outside, "nothing")


class PID(actors.PID):
    """A PID controller whose reset takes effect after the measurement of its tag."""

    reset: InputPort[Any] = but(actors.PID.reset, doc="resets I and forgets the slope, after the measurement")

    def fire(self) -> None:
        self._work()
        if self.reset.present:
            self._forget()


class Ramp(actors.Ramp):
    """Counts triggers; a new step takes effect after the next number."""

    _then: float = 0  # the step after the last number

    def initialize(self) -> None:
        super().initialize()
        self._then = 0

    def following(self) -> float:
        found = self.init if self._last is None else self._last + self._then
        self._then = self.step
        return found


class Select(actors.Select):
    """Passes on tokens of the channel that ``control`` names; those of the others wait."""

    unread = preset(actors.Select.unread, "kept")


class Switch(actors.Switch):
    """Sends each token to the channel that ``control`` names, or to none."""

    outside = preset(actors.Switch.outside, "nothing")


class Test(actors.Test):
    """Compares tokens with expected values; others may follow, a number matches its text, and NaN any number."""

    follow = preset(actors.Test.follow, True)

    def equals(self, token: Any, expected: Any) -> bool:
        if isinstance(expected, str) is not isinstance(token, str):
            return _is_text_of(expected, token) if isinstance(expected, str) else _is_text_of(token, expected)
        return (
            super().equals(token, expected)
            or (_is_nan(token) and _is_number(expected))
            or (_is_nan(expected) and _is_number(token))
        )


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _is_nan(value: Any) -> bool:
    return isinstance(value, float) and math.isnan(value)


def _is_text_of(text: str, value: Any) -> bool:
    """Whether a text is a truth value or a number as written by Java."""
    if isinstance(value, bool):
        return text == ("true" if value else "false")
    if isinstance(value, int):
        return text == str(value)
    try:
        return isinstance(value, float) and not text.lstrip("-").isdigit() and float(text) == value
    except ValueError:
        return False
