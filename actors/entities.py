"""Entities, which are tokens with fields, and lists: SetFields, RecordAssembler, RecordDisassembler, Batch, Unbatch,
Collect, Spread, Match."""

from __future__ import annotations

from collections import deque
from collections.abc import Hashable, Mapping
from typing import Any

import numpy as np

from .core import (
    Actor,
    EpicycleError,
    InputPort,
    MappingParameter,
    OutputPort,
    Parameter,
    ParameterError,
    Queues,
    Tally,
    Wake,
    brief,
    texts_parameter,
)
from .distributions import Distribution
from .expression import TokenFormulaParameter, field_of, operand


class SetFields(Actor):
    """Sets fields of tokens: a token with fields is a mapping, as YAML writes it and expressions read it.

    ``draw: {work: {type: Exponential, mean: 5 s}}`` draws fields, then ``set: {due: came + 2 * work}`` computes some,
    one after the other, over the token's fields, ``token`` (as it came) and ``time`` (s).  A token without fields, such
    as a number, is replaced by one with these fields alone.  The original token is not changed, because other actors
    may have received it.
    Ptolemy: ``RecordUpdater``.
    """

    input = InputPort(doc="the tokens")
    output: OutputPort[Any] = OutputPort(dict, doc="each token with its fields set")

    draw: Parameter[dict[str, Distribution]] = MappingParameter(
        Parameter(Distribution), {}, doc="distributions of fields to draw; times in s"
    )
    set: Parameter[dict[str, Any]] = MappingParameter(
        TokenFormulaParameter(known=("token", "time")), {}, doc="expressions for fields, computed in order"
    )
    remove = texts_parameter((), doc="fields to remove, after all others are set")

    def initialize(self) -> None:
        self._draws = [(name, each.draw, self.random_stream(name)) for name, each in self.draw.items()]

    def fire(self) -> None:
        now = self.now
        for token in self.input.tokens:
            seen = operand(token)
            fields = seen.copy() if type(seen) is dict else {}
            for name, draw, stream in self._draws:
                fields[name] = draw(stream)
            for name, formula in self.set.items():
                fields[name] = formula.call(fields, seen, now)
            for name in self.remove:
                fields.pop(name, None)
            self.output.send(fields)


class RecordAssembler(Actor):
    """Makes one token with fields from tokens at several inputs, which have the names of the fields.

    It waits until there is a token at each input; further ones wait in the order of arrival.  ``onto`` is the name of
    one more input: its tokens have fields already, which are kept unless they are set here.  With ``apart``, each token
    makes a token by itself, with a single field.
    Ptolemy: ``RecordAssembler``, ``RecordUpdater`` (``onto: input``), ``UnionMerge`` (``apart``).
    """

    output: OutputPort[Any] = OutputPort(dict, doc="tokens with these fields")

    fields = texts_parameter(doc="names of the fields and the inputs")
    onto = Parameter(str, None, doc="name of an input whose tokens get these fields in addition to their own")
    apart = Parameter(bool, False, doc="whether each token makes a token by itself, in the order of the fields")

    def own_ports(self) -> dict[str, InputPort[Any] | OutputPort[Any]]:
        _check_names(self.fields)
        ports: dict[str, InputPort[Any] | OutputPort[Any]] = {name: InputPort(doc="a field") for name in self.fields}
        if self.onto in ports:
            raise ParameterError(f"onto: {self.onto!r} is also one of the fields; choose another name")
        if self.onto is not None and self.apart:
            raise ParameterError("onto and apart exclude each other: with 'apart', fields are not added to a token")
        return ports if self.onto is None else {self.onto: InputPort(doc="tokens with fields"), **ports}

    def initialize(self) -> None:
        self._waiting = Queues(*self.inputs.values())

    def fire(self) -> None:
        if self.apart:
            for name, port in self.inputs.items():
                for token in port.tokens:
                    self.output.send({name: token})
            return
        for tokens in self._waiting.rounds():
            found = dict(zip(self.inputs, tokens, strict=True))
            base = {} if self.onto is None else operand(found.pop(self.onto))
            if not isinstance(base, Mapping):
                raise EpicycleError(f"the token {brief(base)} has no fields")
            self.output.send({**base, **found})


class RecordDisassembler(Actor):
    """Sends fields of each token by outputs with the names of the fields.

    Ptolemy: ``RecordDisassembler``, ``UnionDisassembler`` (``partial``).
    """

    input = InputPort(doc="tokens with fields")

    fields = texts_parameter(doc="names of the fields and the outputs")
    partial = Parameter(bool, False, doc="whether tokens may lack some of the fields")

    def own_ports(self) -> dict[str, InputPort[Any] | OutputPort[Any]]:
        _check_names(self.fields)
        return {name: OutputPort(doc="a field") for name in self.fields}

    def fire(self) -> None:
        for token in self.input.tokens:
            for name in self.fields:
                if not self.partial or (isinstance(token, Mapping) and name in token):
                    self.outputs[name].send(field_of(token, name))


def _check_names(fields: tuple[str, ...]) -> None:
    if not fields:
        raise ParameterError("fields: the list is empty; name at least one field")
    for name in fields:
        if fields.count(name) > 1:
            raise ParameterError(f"fields: {name!r} is listed twice")


class Batch(Actor):
    """Collects tokens into lists: ``number`` of them, or as many as fit into ``size``, or those that came within
    ``after``.

    Tokens with different values of ``key`` go into different batches.  A batch is full when it has ``number`` tokens,
    or when the sizes of its tokens (``weight``) add up to ``size``; a token that would exceed it begins the next batch.
    ``trigger`` sends all batches as they are.  Sources: Pegden and others, Introduction to Simulation Using SIMAN
    (group); Ptolemy: ``SequenceToArray``.
    """

    input = InputPort(doc="tokens to collect")
    trigger = InputPort(required=False, doc="sends all batches as they are")
    output: OutputPort[Any] = OutputPort(list, doc="a batch, with its tokens in the order of arrival")
    waiting = OutputPort(int, doc="number of tokens that wait for the rest of their batch, whenever it changes")

    number = Parameter(int, None, min=1, doc="tokens in a full batch")
    size = Parameter(float, None, above=0, doc="largest size of a batch")
    weight = TokenFormulaParameter(
        "1", known=("time",), doc="size of a token: an expression over its fields, token, time"
    )
    after = Parameter(float, None, unit="s", min=0, doc="longest wait of the first token of a batch")
    key: Parameter[Any] = TokenFormulaParameter(
        None, doc="tokens of a batch have this value in common: an expression over their fields, and token"
    )

    def initialize(self) -> None:
        if self.number is None and self.size is None and self.after is None and not self.trigger.width:
            raise ParameterError(f"{self.path} never sends: give 'number', 'size' or 'after', or connect 'trigger'")
        self._batches: dict[Any, _Open] = {}
        self._count = Tally(self.waiting)

    def fire(self) -> None:
        for key in [key for key, batch in self._batches.items() if batch.wake is not None and batch.wake.due]:
            self._close(key)
        for token in self.input.tokens:
            self._collect(token)
        if self.trigger.present:
            for key in list(self._batches):
                self._close(key)
        self._count.tell(sum(len(batch.tokens) for batch in self._batches.values()))

    def _collect(self, token: Any) -> None:
        key = _hashable(None if self.key is None else self.key.call(token))
        weight = 0.0
        if self.size is not None:
            weight = self.weight.number("a weight", token, self.now)
            if weight < 0:
                raise EpicycleError(f"{self.weight} gives {weight:g} for {brief(token)}, but a weight must be >= 0")
            if key in self._batches and self._batches[key].size + weight > self.size:
                self._close(key)
        batch = self._batches.get(key)
        if batch is None:
            wake = None if self.after is None else self.wake_in(self.after)
            batch = self._batches[key] = _Open(wake)
        batch.tokens.append(token)
        batch.size += weight
        is_full = self.number is not None and len(batch.tokens) >= self.number
        if is_full or (self.size is not None and batch.size >= self.size):
            self._close(key)

    def _close(self, key: Hashable) -> None:
        batch = self._batches.pop(key)
        if batch.wake is not None:
            batch.wake.cancel()
        self.output.send(batch.tokens)


class _Open:
    """A batch that is not full."""

    def __init__(self, wake: Wake | None) -> None:
        self.wake = wake
        self.tokens: list[Any] = []
        self.size = 0.0


class Unbatch(Actor):
    """Sends the items of a list one by one, at the same tag.

    Ptolemy: ``ArrayToSequence``.
    """

    input = InputPort(doc="lists")
    output = OutputPort(doc="the items of the lists")

    def fire(self) -> None:
        for token in self.input.tokens:
            for item in _items(token):
                self.output.send(item)


def _items(token: Any) -> Any:
    """A token that is a list, with its items unchanged; raises ``EpicycleError`` if it is not one."""
    if isinstance(token, np.ndarray) and token.ndim == 1:
        return token.tolist()  # plain numbers, and not those of NumPy
    if isinstance(seen := operand(token), list):
        return token
    raise EpicycleError(f"{brief(seen)} is not a list")


class Collect(Actor):
    """Makes a list of one token from each channel, once every channel has one; others wait in the order of arrival.
    With ``joined``, the tokens are lists, which are joined to one.
    Ptolemy: ``ElementsToArray``, ``ArrayAppend`` (``joined``).
    """

    input = InputPort(multi=True, doc="tokens to collect")
    output: OutputPort[Any] = OutputPort(list, doc="a token of each channel, in the order of the channels")

    joined = Parameter(bool, False, doc="whether the tokens are lists, to be joined")

    def initialize(self) -> None:
        self._waiting = Queues(self.input)

    def fire(self) -> None:
        for found in self._waiting.rounds():
            if self.joined:
                found[:] = [item for each in found for item in _items(each)]
            self.output.send(found)


class Spread(Actor):
    """Sends the items of a list over the channels of its output, in order; surplus items are lost.

    Ptolemy: ``ArrayToElements``.
    """

    input = InputPort(doc="lists")
    output = OutputPort(multi=True, doc="the items of a list, one on each channel")

    def fire(self) -> None:
        for token in self.input.tokens:
            for channel, item in zip(range(self.output.width), _items(token), strict=False):
                self.output.send(item, channel)


class Match(Actor):
    """Waits until there is a token with an equal ``key`` on every channel, and sends them as a list: a join.

    The matching fork is an output with several connections.  Tokens of one channel with equal keys wait in the order of
    arrival; without ``key``, all tokens are equal.  Sources: Pegden and others, Introduction to Simulation Using SIMAN
    (match); Ptolemy: ``Synchronizer``, for tokens without a key.
    """

    input = InputPort(multi=True, doc="the parts")
    output: OutputPort[Any] = OutputPort(list, doc="a token of each channel, in the order of the channels")
    waiting = OutputPort(int, doc="number of tokens that wait for others, whenever it changes")

    key: Parameter[Any] = TokenFormulaParameter(
        None, doc="tokens with an equal value belong together: an expression over their fields, and token"
    )

    def initialize(self) -> None:
        self._parts: dict[Any, list[deque[Any]]] = {}
        self._count = Tally(self.waiting)

    def fire(self) -> None:
        count = self._count.number
        for channel, token in self.input.arrivals():
            key = None if self.key is None else _hashable(self.key.call(token))
            if (parts := self._parts.get(key)) is None:
                parts = self._parts[key] = [deque() for _ in range(self.input.width)]
            parts[channel].append(token)
            count += 1
            if all(parts):
                self.output.send([part.popleft() for part in parts])
                count -= len(parts)
                if not any(parts):
                    del self._parts[key]
        self._count.tell(count)


def _hashable(key: Any) -> Hashable:
    if isinstance(key, (int, float, str)):  # nearly always
        return key
    if isinstance(key, list):
        return tuple(map(_hashable, key))
    if isinstance(key, Mapping):
        return frozenset((name, _hashable(value)) for name, value in key.items())
    return key  # type: ignore[no-any-return]
