"""Where tokens go and when: Merge, Router, Switch, BooleanSwitch, Select, Repeat, Sampler, MostRecent, Synchronizer."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import Any

from .core import (
    ABSENT,
    Actor,
    EpicycleError,
    InputPort,
    OutputPort,
    Parameter,
    ParameterError,
    PortError,
    PortParameter,
    Queues,
    any_parameter,
    array_parameter,
    brief,
    counted,
    rounds,
)
from .core.choices import cumulated, weighted
from .expression import TokenFormula, TokenFormulaParameter


class Merge(Actor):
    """Joins the tokens of all its channels into one stream, one token per microstep.

    Of tokens at the same tag, that of the lowest channel is sent first, the others at the following microsteps; with
    ``discard``, the others are lost.  Ptolemy: ``Merge``.
    """

    input = InputPort(multi=True, doc="the streams")
    output = OutputPort(doc="the tokens, one at a time")

    discard = Parameter(bool, False, doc="whether only the first token of a tag is sent")

    def initialize(self) -> None:
        self._waiting = Queues(self.input)

    def fire(self) -> None:
        self._waiting.come()
        first = next(filter(None, self._waiting.channels), None)
        if first is None:
            return
        self.output.send(first.popleft())
        if self.discard:
            for queue in self._waiting.channels:
                queue.clear()
        elif any(self._waiting.channels):
            self.wake_in(0)


class Router(Actor):
    """Sends each token to one channel of its output: in turn, at random, to the least loaded, or by a property of the
    token.

    For ``shortest queue``, connect to ``load`` the load behind each channel, such as the ``size`` of a ``Server``, in
    the order of the output's channels.  A load is 0 before the first value, plus one for each token sent since the
    latest value.  Ties are broken at random.  For ``expression``, give ``channel:
    number % 3``, over the token's fields.  Ptolemy: ``Distributor``.
    """

    input = InputPort(doc="tokens to pass on")
    load = InputPort(float, multi=True, required=False, doc="the load behind each channel of the output")
    output = OutputPort(multi=True, depends_on=("input",), doc="a channel for each connection, in order")

    policy = Parameter(
        str,
        "round robin",
        choices=("round robin", "random", "shortest queue", "expression"),
        renamed={"in turn": "round robin"},
        doc="how the channel is chosen",
    )
    weights = array_parameter(
        (None,), None, unit="1", min=0, doc="relative probability of each channel with 'random'; all equal if left out"
    )
    channel: Parameter[Any] = TokenFormulaParameter(
        None,
        known=("time", "channels"),
        doc="the channel for 'expression', from 0: an expression over the token's fields, token, time, channels "
        "(their number)",
    )

    def check(self) -> None:
        for name, policy in (("weights", "random"), ("channel", "expression")):
            if getattr(self, name) is not None and self.policy != policy:
                raise ParameterError(f"{name}: it is for the policy {policy!r}, but the policy is {self.policy!r}")
        if self.policy == "expression" and self.channel is None:
            raise ParameterError("policy: 'expression' needs 'channel', an expression for the channel of a token")
        self._sums: list[float] | None = None
        if self.weights is not None:
            try:
                self._sums = cumulated(self.weights.tolist())
            except ValueError as error:
                raise ParameterError(str(error)) from None

    def initialize(self) -> None:
        self._next = 0
        width = self.output.width
        if self.policy == "shortest queue" and self.load.width != width:
            raise PortError(
                f"{self.output.path} has {counted(width, 'channel')} and {self.load.path} has {self.load.width}; "
                "'shortest queue' needs one load for each channel"
            )
        if self._sums is not None and len(self._sums) != width:
            raise PortError(
                f"{self.output.path} has {counted(width, 'channel')}, but there are {len(self._sums)} weights; give "
                "one for each"
            )
        self._loads = [0.0] * width

    def fire(self) -> None:
        if not self.output.width:
            return
        for place, load in self.load.arrivals():
            self._loads[place] = load
        for token in self.input.tokens:
            self._next = self._chosen(token)
            self.output.send(token, self._next)
            self._next = (self._next + 1) % self.output.width

    def _chosen(self, token: Any) -> int:
        if self.policy == "round robin":
            return self._next
        width = self.output.width
        if self.policy == "random":
            return self.random.below(width) if self._sums is None else weighted(self.random, self._sums)
        if self.policy == "expression":
            return channel_of(token, self.channel, self.output, self.now, width)
        least = min(self._loads)
        places = [place for place, load in enumerate(self._loads) if load == least]
        place = places[self.random.below(len(places))] if len(places) > 1 else places[0]
        self._loads[place] += 1.0
        return place


def channel_of(token: Any, formula: TokenFormula, output: OutputPort[Any], *given: float) -> int:
    """The channel of an output that an expression gives for a token; raises ``EpicycleError`` if there is none."""
    number = formula.call(token, *given)
    if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number < max(output.width, 1):
        raise EpicycleError(
            f"{formula} gives {number!r} for {brief(token)}, but {output.path} has {counted(output.width, 'channel')}, "
            "counted from 0"
        )
    return number


class Switch(Actor):
    """Sends each token to the channel of its output that the latest ``control`` token names.

    Ptolemy: ``Switch``.
    """

    input = InputPort(doc="tokens to pass on")
    control = InputPort(int, doc="number of the channel, from 0; 0 until a token comes")
    output = OutputPort(multi=True, doc="a channel for each connection, in order")

    outside = Parameter(
        str,
        "error",
        choices=("error", "nothing"),
        doc="what is sent while control does not name a channel",
    )

    def initialize(self) -> None:
        self._channel = 0

    def fire(self) -> None:
        width = self.output.width
        if self.control.present and self.outside == "nothing":
            self._channel = self.control.value
        elif self.control.present:
            self._channel = _channel(self.control.value, self.control.path, width, "output")
        if self.outside == "error" or 0 <= self._channel < width:
            for token in self.input.tokens:
                self.output.send(token, self._channel if width else None)


class BooleanSwitch(Actor):
    """Sends each token to ``true_output`` or ``false_output``, according to the latest ``control`` token.

    With several connections of ``input``, each channel leads to the channel of the outputs with the same number.
    Ptolemy: ``BooleanSwitch``, ``ConfigurationSwitch`` (whose ``selector`` is ``control``).
    """

    input = InputPort(multi=True, doc="tokens to pass on")
    true_output = OutputPort(multi=True, doc="the tokens that come while control is true")
    false_output = OutputPort(multi=True, doc="the tokens that come while control is false")

    control = PortParameter(bool, False, doc="where to")

    def fire(self) -> None:
        output = self.true_output if self.control else self.false_output
        for channel, token in self.input.arrivals():
            if self.input.width == 1 or channel < output.width:
                output.send(token, None if self.input.width == 1 else channel)


class Select(Actor):
    """Passes on the tokens of the channel that the latest ``control`` token names; those of the others are lost.

    If unread tokens are ``kept``, those of the others wait until they are chosen.  Each token of ``control`` then lets
    one token pass, the last one all that follow on its channel; a number that does not name a channel lets none pass.
    Ptolemy: ``Multiplexor`` and ``BooleanMultiplexor`` (true is channel 1), with tokens kept ``Select``.
    """

    input = InputPort(multi=True, doc="a channel for each connection, in order")
    control = InputPort(int, doc="number of the channel, from 0")
    output = OutputPort(doc="the tokens of the chosen channel")

    unread = Parameter(str, "lost", choices=("lost", "kept"), doc="what happens to tokens that are not chosen")
    initial = Parameter(
        int, 0, min=0, optional=True, doc="the channel until the first token of control comes; no channel if null"
    )

    def initialize(self) -> None:
        self._channel = self.initial
        if self.initial is not None and self.unread == "lost":
            _channel(self.initial, f"{self.path}.initial", self.input.width, "input")
        self._controls: deque[int] = deque()
        self._waiting = Queues(self.input)

    def fire(self) -> None:
        if self.unread == "kept":
            self._controls.extend(self.control.tokens)
            self._waiting.come()
            while self._pass_on():
                pass
            return
        if self.control.present:
            self._channel = _channel(self.control.value, self.control.path, self.input.width, "input")
        for token in () if self._channel is None else self.input.by_channel()[self._channel]:
            self.output.send(token)

    def _pass_on(self) -> bool:
        """Take the next control token and pass one token on; false if there is neither."""
        is_told = bool(self._controls)
        if is_told:
            self._channel = self._controls.popleft()
        waiting = self._waiting.channels
        if self._channel is None or not 0 <= self._channel < len(waiting) or not waiting[self._channel]:
            return is_told
        self.output.send(waiting[self._channel].popleft())
        return True


class Repeat(Actor):
    """Sends each token a number of times.

    Ptolemy: ``Repeat``.
    """

    input = InputPort(doc="tokens to repeat")
    output = OutputPort(doc="each token, 'times' times")

    times = PortParameter(int, 2, min=0, doc="how many times each token is sent")

    def fire(self) -> None:
        for token in self.input.tokens:
            for _ in range(self.times):
                self.output.send(token)


class ByChannel(Actor):
    """The common part of actors with an input and an output whose channels belong together."""

    input = InputPort(multi=True, doc="the streams")
    output = OutputPort(multi=True, doc="the tokens of the input, channel by channel")

    def initialize(self) -> None:
        wanted, found = self.input.width, self.output.width
        if wanted > 1 and found not in (0, wanted):
            raise PortError(
                f"{self.input.path} has {wanted} channels and {self.output.path} has {found}; give both the same "
                "number of channels, because each channel of the input leads to one of the output"
            )

    def send(self, token: Any, channel: int) -> None:
        """Send the tokens of a channel."""
        if self.input.width == 1 or self.output.width == 0:
            self.output.send(token)
        else:
            self.output.send(token, channel)


class Sampler(ByChannel):
    """Passes on tokens that come at the same tag as a trigger; all others are lost.

    Ptolemy: ``Sampler``.
    """

    trigger = InputPort(multi=True, doc="when to pass tokens on")

    def fire(self) -> None:
        if self.trigger.present:
            for channel, token in self.input.arrivals():
                self.send(token, channel)


class Holding(ByChannel):
    """The common part of actors that send the latest token of each channel."""

    initial = any_parameter(None, doc="value of a channel before its first token")

    def initialize(self) -> None:
        super().initialize()
        self._held: list[Any] = [self.initial] * self.input.width

    def hold(self, tokens: Sequence[Any]) -> None:
        """Store new tokens, one for each channel, or ``ABSENT``."""
        self._held = [old if new is ABSENT else new for old, new in zip(self._held, tokens, strict=True)]

    def send_held(self) -> None:
        """Send what is held."""
        for channel, token in enumerate(self._held):
            if token is not None:
                self.send(token, channel)


class MostRecent(Holding):
    """Sends the latest token of each channel whenever it is triggered, even if it has not changed: a zero-order hold.

    A channel on which no token has come yet sends ``initial``, or nothing if that is left out.
    Ptolemy: ``MostRecent``, ``ZeroOrderHold``.
    """

    trigger = InputPort(multi=True, doc="when to send; triggers that come together, one on each channel, count as one")

    def fire(self) -> None:
        self.hold_latest()
        self.answer()

    def hold_latest(self) -> None:
        """Store the latest tokens."""
        self.hold([tokens[-1] if tokens else ABSENT for tokens in self.input.by_channel()])

    def answer(self) -> None:
        """Send what is held for each trigger."""
        for _ in rounds(self.trigger):
            self.send_held()


class Synchronizer(ByChannel):
    """Waits until there is a token on every channel, and then sends one of each at the same tag.

    Tokens wait in the order of arrival.  Ptolemy: ``Synchronizer``.
    """

    def initialize(self) -> None:
        super().initialize()
        self._waiting = Queues(self.input)

    def fire(self) -> None:
        for tokens in self._waiting.rounds():
            for channel, token in enumerate(tokens):
                self.send(token, channel)


def _channel(number: int, told_by: str, width: int, name: str) -> int:
    if not 0 <= number < max(width, 1):
        raise PortError(f"{told_by} is {number}, but {name} has {counted(width, 'channel')}, counted from 0")
    return int(number)
