"""Actors that compute: in Ptolemy they take tokens of any type, and each token once."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial, reduce
from itertools import repeat
from typing import Any

from epicycle import actors
from epicycle.actors import Actor, EpicycleError, InputPort, OutputPort, counted, present, rounds
from epicycle.actors.expression import operand, text_of

from .changing import Singly, Together, but, preset


def _of_any_type(kind: type[Actor], *outputs: str) -> type[Actor]:
    """An actor some of whose outputs send tokens of any type."""
    return _variant(kind, kind.__doc__, {name: but(getattr(kind, name), type=Any) for name in outputs})


def _with_default(kind: type[Actor], name: str, default: object, doc: str) -> type[Actor]:
    """An actor with another default of a parameter."""
    return _variant(kind, doc, {name: preset(getattr(kind, name), default)})


def _variant(kind: type[Actor], doc: str | None, declared: dict[str, Any]) -> type[Actor]:
    return type(kind.__name__, (kind,), {"__doc__": doc, "__module__": __name__, **declared})


Difference = _of_any_type(actors.Difference, "output")
Extreme = _of_any_type(actors.Extreme, "value")
MathFunction = _of_any_type(actors.MathFunction, "output")
MovingAverage = _of_any_type(actors.MovingAverage, "output")
MovingStatistics = _of_any_type(actors.MovingStatistics, "min", "max")
LookupTable = _with_default(
    actors.LookupTable, "outside", "nothing", "Looks a number up in a table; nothing is sent for one outside."
)
Select = _with_default(
    actors.Select, "unread", "kept", "Passes on tokens of the channel that ``control`` names; those of the others wait."
)
Switch = _with_default(
    actors.Switch, "outside", "nothing", "Sends each token to the channel that ``control`` names, or to none."
)


def _are_numbers(tokens: list[Any]) -> bool:
    return all(isinstance(each, (int, float)) for each in tokens)


def added(left: Any, right: Any) -> Any:
    """The sum; if one side is a text, both are joined as texts."""
    if isinstance(left, str) or isinstance(right, str):
        return text_of(left) + text_of(right)
    return item_by_item(left, right, operator.add)


def item_by_item(left: Any, right: Any, compute: Callable[[Any, Any], Any]) -> Any:
    """A sum or similar of numbers, of lists of them, or of fields that both sides have; a number is combined with each
    item of a list."""
    left, right = operand(left), operand(right)
    if isinstance(left, Mapping) and isinstance(right, Mapping):
        return {name: item_by_item(left[name], right[name], compute) for name in left if name in right}
    lists = [each for each in (left, right) if isinstance(each, (list, tuple))]
    if lists:
        if len(lists[0]) != len(lists[-1]):
            raise EpicycleError(f"{left!r} has {counted(len(left), 'item')}, but {right!r} has {len(right)}")
        ones, others = (each if isinstance(each, (list, tuple)) else repeat(each) for each in (left, right))
        return [item_by_item(one, other, compute) for one, other in zip(ones, others, strict=False)]
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
                whole = reduce(added, above[1:], above[0] if above else 0)
                self.output.send(reduce(partial(item_by_item, compute=operator.sub), below, whole))


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
        return [port for port in self.inputs.values() if port.width and port.name not in self.held]

    def fire(self) -> None:
        for name in self.held if self.waited_for() else ():
            port = self.inputs[name]
            if port.present:
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


class Test(actors.Test):
    """Compares tokens with expected values; others may follow, a number matches its text, and NaN any number."""

    follow = preset(actors.Test.follow, True)

    def equals(self, token: Any, expected: Any) -> bool:
        if isinstance(expected, str) is not isinstance(token, str):
            text, value = (expected, token) if isinstance(expected, str) else (token, expected)
            if isinstance(value, float):
                with suppress(ValueError):
                    return not text.lstrip("-").isdigit() and float(text) == value
            return bool(text == text_of(value))
        pair = token, expected
        is_nan = any(isinstance(each, float) and math.isnan(each) for each in pair)
        is_of_numbers = all(isinstance(each, (int, float)) and not isinstance(each, bool) for each in pair)
        return super().equals(token, expected) or (is_nan and is_of_numbers)


class Dictionary(Actor):
    """Stores tokens by keys, and sends them when asked.

    A key is any token, by its text.  One at ``write_key`` stores the token at ``value``, or forgets the key if none has
    come.  A key that is not stored gives null, and is sent by ``not_found``.  Writing comes before reading.
    Ptolemy: ``Dictionary``.
    """

    write_key: InputPort[Any] = InputPort(required=False, doc="the key of the token at 'value'")
    value: InputPort[Any] = InputPort(required=False, doc="the token to store")
    read_key: InputPort[Any] = InputPort(required=False, doc="the key to look up")
    read_key_array: InputPort[list[Any]] = InputPort(list, required=False, doc="several keys to look up")
    trigger_keys: InputPort[Any] = InputPort(required=False, doc="when to send all keys")
    result: OutputPort[Any] = OutputPort(doc="the token of 'read_key'")
    result_array: OutputPort[list[Any]] = OutputPort(list, doc="the tokens of 'read_key_array'")
    not_found: OutputPort[list[str]] = OutputPort(list, doc="the keys that are not stored")
    keys: OutputPort[list[str]] = OutputPort(list, doc="all keys, in the order in which they were first stored")

    def initialize(self) -> None:
        self._stored: dict[str, Any] = {}

    def fire(self) -> None:
        if self.write_key.present:
            key = text_of(self.write_key.value)
            if self.value.present and self.value.value is not None:
                self._stored[key] = self.value.value
            else:
                self._stored.pop(key, None)
        if self.read_key.present:
            self._look_up(self.result, [self.read_key.value], lambda found: found[0])
        if self.read_key_array.present:
            self._look_up(self.result_array, self.read_key_array.value, list)
        if self.trigger_keys.present:
            self.keys.send([*self._stored])

    def _look_up(self, port: OutputPort[Any], tokens: list[Any], made: Callable[[list[Any]], Any]) -> None:
        keys = [text_of(each) for each in tokens]
        port.send(made([self._stored.get(key) for key in keys]))
        if missing := [key for key in keys if key not in self._stored]:
            self.not_found.send(missing)
