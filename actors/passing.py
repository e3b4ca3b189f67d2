"""Actors that pass on some of the tokens of a stream, or at other times: Filter, Inhibit, FirstOfInstant, Changes,
Previous, Register, LatestOfAll, BooleanSelect, Commutator, Sequencer, Default, IsPresent."""

from __future__ import annotations

from collections import deque
from typing import Any

from .core import (
    ABSENT,
    Actor,
    EpicycleError,
    InputPort,
    OutputPort,
    Parameter,
    Queues,
    any_parameter,
    brief,
    present,
    rounds,
)
from .expression import TokenFormulaParameter
from .flow import ByChannel, Holding, MostRecent


class Filter(ByChannel):
    """Passes on the tokens for which a condition holds; the others are lost.

    Ptolemy: ``EventFilter``, ``TrueGate``.
    """

    condition = TokenFormulaParameter(
        "token", known=("time",), doc="which tokens pass: an expression over the token's fields, token, time"
    )

    def fire(self) -> None:
        for channel, token in self.input.arrivals():
            passes = self.condition.call(token, self.now)
            if not isinstance(passes, bool):
                raise EpicycleError(f"{self.condition} gives {passes!r} for {brief(token)}, expected true or false")
            if passes:
                self.send(token, channel)


class Inhibit(ByChannel):
    """Passes on tokens unless an ``inhibit`` token comes with them; the opposite of a ``Sampler``.

    Of several tokens of a channel at one tag, each ``inhibit`` token stops one, beginning with the first.
    Ptolemy: ``Inhibit``.
    """

    inhibit = InputPort(multi=True, doc="when to stop tokens")

    def fire(self) -> None:
        for tokens, inhibits in rounds(self.input, self.inhibit):
            for channel, token in enumerate(tokens):
                if token is not ABSENT and not present(inhibits):
                    self.send(token, channel)


class FirstOfInstant(Actor):
    """Passes on the first token of each instant; others at the same time, also at later microsteps, are lost.

    Ptolemy: ``SuppressSimultaneousEvents``.
    """

    input = InputPort(doc="the stream")
    output = OutputPort(doc="the first token of each instant")

    def initialize(self) -> None:
        self._last: int | None = None

    def fire(self) -> None:
        for token in self.input.tokens:
            if self._last != self.tag.time:
                self._last = self.tag.time
                self.output.send(token)


class Changes(Actor):
    """Passes on the first number, and then each that differs by more than ``by`` from the last one passed on.

    Source: M. Miskowicz, Send-on-delta concept, Sensors 6, 2006.  Ptolemy: ``QuantizedSampler``.
    """

    input = InputPort(float, doc="the numbers")
    output = OutputPort(float, doc="the numbers that differ enough")

    by = Parameter(float, 0.0, min=0, doc="difference up to which a number is held back")

    def initialize(self) -> None:
        self._last: float | None = None

    def fire(self) -> None:
        for token in self.input.tokens:
            if self._last is None or not abs(token - self._last) <= self.by:  # nan differs from every number
                self._last = token
                self.output.send(token)


class Previous(Actor):
    """Sends for each token the one before it; for the first one ``initial``, or nothing if that is left out.

    Ptolemy: ``Previous``.
    """

    input = InputPort(doc="the stream")
    output = OutputPort(doc="the stream, one token behind")

    initial = any_parameter(None, doc="value sent for the first token")

    def initialize(self) -> None:
        self._before = self.initial

    def fire(self) -> None:
        for token in self.input.tokens:
            if self._before is not None:
                self.output.send(self._before)
            self._before = token


class Register(MostRecent):
    """Sends the latest token of each channel from before this tag whenever it is triggered.

    The output does not depend on the input within the same tag, so the actor may be part of a loop.  Ptolemy:
    ``Register``.
    """

    output = OutputPort(multi=True, depends_on=("trigger",), doc="the tokens from before this tag, channel by channel")

    def fire(self) -> None:
        self.answer()
        self.hold_latest()


class LatestOfAll(Holding):
    """Sends the latest token of every channel whenever a token comes on any of them.

    A channel on which no token has come yet sends ``initial``, or nothing if that is left out.  Ptolemy: ``Wire``.
    """

    def fire(self) -> None:
        for (tokens,) in rounds(self.input):
            self.hold(tokens)
            self.send_held()


class BooleanSelect(Actor):
    """Each ``control`` token lets the next token of ``true_input`` or ``false_input`` pass.

    Tokens wait until they are chosen, and control tokens until the chosen input has a token, on each channel if there
    are several.  If unread tokens are ``lost``, the latest control token applies, and tokens that are not chosen are
    lost.
    Ptolemy: ``BooleanSelect``, with tokens lost ``BooleanMultiplexor``.
    """

    true_input = InputPort(multi=True, required=False, doc="tokens that pass for a true control token")
    false_input = InputPort(multi=True, required=False, doc="tokens that pass for a false one")
    control = InputPort(bool, doc="which input is next: true or false")
    output = OutputPort(multi=True, doc="the chosen tokens, channel by channel")

    unread = Parameter(str, "kept", choices=("kept", "lost"), doc="what happens to tokens that are not chosen")

    def initialize(self) -> None:
        self._control: bool | None = None
        self._controls: deque[bool] = deque()
        self._waiting = {True: Queues(self.true_input), False: Queues(self.false_input)}

    def fire(self) -> None:
        if self.unread == "lost":
            self._hand_on()
            return
        self._controls.extend(self.control.tokens)
        for queues in self._waiting.values():
            queues.come()
        while self._controls and all(chosen := self._waiting[self._controls[0]].channels):
            self._controls.popleft()
            for channel, queue in enumerate(chosen):
                self.output.send(queue.popleft(), None if len(chosen) == 1 else channel)

    def _hand_on(self) -> None:
        """Send the tokens of the input that the latest control token chose."""
        if self.control.present:
            self._control = self.control.value
        if self._control is not None:
            chosen = self.true_input if self._control else self.false_input
            for channel, token in chosen.arrivals():
                self.output.send(token, None if chosen.width == 1 else channel)


class Commutator(Actor):
    """Passes on tokens from the channels of its input in turn, ``block`` from each; tokens wait for their turn.

    Ptolemy: ``Commutator``, ``SingleTokenCommutator`` (``waits: false``).
    """

    input = InputPort(multi=True, doc="a channel for each connection, in order")
    output = OutputPort(doc="the tokens in turn")

    block = Parameter(int, 1, min=1, doc="number of tokens that a channel sends in its turn, when it has them all")
    waits = Parameter(bool, True, doc="whether the others wait while a channel in its turn has too few tokens")

    def initialize(self) -> None:
        self._waiting = Queues(self.input)
        self._next = 0

    def fire(self) -> None:
        self._waiting.come()
        queues = self._waiting.channels
        while any(len(each) >= self.block for each in queues):
            if len(queue := queues[self._next]) >= self.block:
                for _ in range(self.block):
                    self.output.send(queue.popleft())
            elif self.waits:
                break
            self._next = (self._next + 1) % len(queues)


class Sequencer(Actor):
    """Passes on tokens in the order of their numbers, which count up from ``first``; each waits for its turn.

    The k-th token has the k-th number; a token whose number has already had its turn is lost.
    Ptolemy: ``Sequencer``, where the number is called ``sequenceNumber``.
    """

    input = InputPort(doc="the tokens")
    number = InputPort(int, doc="the number of each token in the sequence")
    output = OutputPort(doc="the tokens in the order of their numbers")

    first = Parameter(int, 0, doc="the first number")

    def initialize(self) -> None:
        self._pairs = Queues(self.input, self.number)
        self._waiting: dict[int, Any] = {}
        self._next = self.first

    def fire(self) -> None:
        for token, number in self._pairs.rounds():
            if number >= self._next:
                self._waiting[number] = token
        while self._next in self._waiting:
            self.output.send(self._waiting.pop(self._next))
            self._next += 1


class Default(Actor):
    """Passes on the token at ``preferred``, or, if there is none, the one at ``alternate``.

    Ptolemy: ``Default``.
    """

    preferred = InputPort(doc="tokens that take precedence")
    alternate = InputPort(doc="tokens that pass if none comes at 'preferred' at the same tag")
    output = OutputPort(doc="the preferred or the alternate token")

    def fire(self) -> None:
        for preferred, alternate in rounds(self.preferred, self.alternate):
            for token in (present(preferred) or present(alternate))[:1]:
                self.output.send(token)


class IsPresent(ByChannel):
    """Sends for each channel whether it has a token, whenever any channel has one.

    Ptolemy: ``IsPresent``.
    """

    output = OutputPort(bool, multi=True, doc="whether there is a token, channel by channel")

    def fire(self) -> None:
        for (tokens,) in rounds(self.input):
            for channel, token in enumerate(tokens):
                self.send(token is not ABSENT, channel)
