"""Expressions that look beyond the tokens of one tag: HoldingExpression, BlockExpression."""

from __future__ import annotations

from collections import deque
from typing import Any

from .core import (
    Actor,
    EpicycleError,
    InputPort,
    Latest,
    MappingParameter,
    OutputPort,
    Parameter,
    ParameterError,
    any_parameter,
    brief,
)
from .expression import FormulaParameter, operand


class HoldingExpression(Actor):
    """Evaluates an expression with some inputs that hold a value from the start.

    Every name in the expression is an input port, as of an ``Expression``.  Those in ``held`` need not be connected:
    they have the value given there until a token comes, and from then on that of the latest token.  The value is sent
    whenever there is a token at each of the other inputs; if all inputs are held, whenever a token comes.
    Ptolemy: actors with a ``PortParameter``, such as ``ArrayElement``: ``input[index]`` with ``held: {index: 0}``.
    """

    output: OutputPort[Any] = OutputPort(doc="the value of the expression")

    expression = FormulaParameter(doc="the expression; its names are the input ports, 'time' is the time in s")
    held: Parameter[dict[str, Any]] = MappingParameter(
        Parameter(object), doc="the inputs that hold a value, with their values at the start"
    )

    def check(self) -> None:
        for name in self.held:
            if name not in self.expression.names:
                raise ParameterError(f"held: {name!r} is not a name in the expression {self.expression}")

    def own_ports(self) -> dict[str, InputPort[Any] | OutputPort[Any]]:
        names = [name for name in self.expression.names if name != "time"]
        return {
            name: InputPort(required=False, doc="a name in the expression, which holds its value")
            if name in self.held
            else InputPort(doc="a name in the expression")
            for name in names
        }

    def initialize(self) -> None:
        self._latest = Latest(self.inputs.values(), hold=self.held, start=self.held)

    def fire(self) -> None:
        for values in self._latest.rounds():
            known = {name: operand(value) for name, value in values.items()}
            self.output.send(self.expression({**known, "time": self.now}))


class BlockExpression(Actor):
    """Evaluates an expression over blocks of ``number`` tokens each, as soon as a block is full.

    ``block`` is the list of its tokens.  ``past`` is the list of the latest tokens before it, as long as the parameter
    ``past``, which gives their values at the start.  With ``items``, the value is a list whose items are sent one by
    one.  For every second token write ``{number: 2, expression: "block[1]"}``; for two zeros after each token,
    ``{expression: "[block[0], 0, 0]", items: true}``.
    Ptolemy: ``DownSample``, ``UpSample``, ``Chop``, ``CountTrues``, ``DelayLine``, and ``Repeat`` for blocks.
    """

    input = InputPort(doc="the stream")
    output: OutputPort[Any] = OutputPort(doc="the value for each block")

    expression = FormulaParameter(doc="the expression, over 'block' and 'past'")
    number = Parameter(int, 1, min=1, doc="tokens in a block")
    past = any_parameter((), shape=(None,), doc="the tokens before the first one, oldest first")
    items = Parameter(bool, False, doc="whether the value is a list whose items are sent one by one")

    def check(self) -> None:
        for name in self.expression.names:
            if name not in ("block", "past"):
                raise ParameterError(f"expression: {name!r} is unknown; the names are 'block' and 'past'")

    def initialize(self) -> None:
        self._block: list[Any] = []
        self._past = deque((operand(value) for value in self.past), maxlen=len(self.past))

    def fire(self) -> None:
        for token in self.input.tokens:
            self._block.append(operand(token))
            if len(self._block) == self.number:
                block, self._block = self._block, []
                value = self.expression({"block": block, "past": list(self._past)})
                self._past.extend(block)
                self._send(value)

    def _send(self, value: Any) -> None:
        if not self.items:
            self.output.send(value)
            return
        if not isinstance(value, list):
            raise EpicycleError(f"{self.expression} gives {brief(value)}, which is not a list of items to send")
        for item in value:
            self.output.send(item)
