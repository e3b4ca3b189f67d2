"""Where tokens go and when: Merge, Router, Switch, BooleanSwitch, Select, Repeat, Sampler, MostRecent, Synchronizer."""

from __future__ import annotations

from collections import deque
from typing import Any

from .core import (
    Actor,
    EpicycleError,
    InputPort,
    OutputPort,
    Parameter,
    ParameterError,
    PortError,
    PortParameter,
    Tag,
    array_parameter,
    brief,
    counted,
    rounds,
)
from .core.choices import cumulated, weighted
from .expression import FormulaParameter, of_token


class Merge(Actor):
    """Joins the tokens of all its channels into one stream, one token per microstep.

    Of tokens at the same tag, that of the lowest channel comes first and the others in the microsteps after; with
    ``discard`` the others are lost.  With ``whole_channel``, as in Ptolemy, all tokens of a channel come at once.
    Ptolemy: ``Merge``.
    """

    input = InputPort(multi=True, doc="the streams")
    output = OutputPort(doc="one token at a time")

    discard = Parameter(bool, False, doc="whether all but the first token of a tag are lost")
    whole_channel = Parameter(
        bool, False, ptolemy=True, doc="whether tokens that come together on one channel leave together"
    )

    def initialize(self) -> None:
        self._waiting: list[deque[Any]] = [deque() for _ in range(self.input.width)]
        self._left: Tag | None = None  # the tag at which a channel was sent whole, and others had to wait

    def fire(self) -> None:
        for queue, tokens in zip(self._waiting, self.input.by_channel(), strict=True):
            queue.extend(tokens)
        first = next((queue for queue in self._waiting if queue), None)
        if first is None or self._left == self.tag:
            return
        self.output.send(first.popleft())
        if self.whole_channel:
            while first:
                self.output.send(first.popleft())
            self._left = self.tag if any(self._waiting) and not self.discard else None
        if self.discard:
            for queue in self._waiting:
                queue.clear()
        elif any(self._waiting):
            self.wake_in(0)


class Router(Actor):
    """Sends each token to one channel of its output: in turn, at random, to the least loaded, or as the token says.

    For ``shortest queue``, ``load`` takes the load of what each channel leads to, such as the ``size`` of a
    ``Server``, in the order of the output's channels; it is 0 before the first value, plus one for each token sent
    before the next value.  Ties are broken at random.  For ``expression``, give ``channel:
    number % 3``, over the token's fields.  Ptolemy: ``Distributor``.
    """

    input = InputPort(doc="what is handed on")
    load = InputPort(float, multi=True, required=False, doc="how much waits behind each channel of the output")
    output = OutputPort(multi=True, depends_on=("input",), doc="a channel for each connection, in their order")

    policy = Parameter(
        str,
        "round robin",
        choices=("round robin", "random", "shortest queue", "expression"),
        renamed={"in turn": "round robin"},
        doc="how the channel is chosen",
    )
    weights: Parameter[Any] = array_parameter(
        (None,), None, unit="1", min=0, doc="how likely each channel is with 'random'; all alike if left out"
    )
    channel: Parameter[Any] = FormulaParameter(
        None, doc="the channel for 'expression', from 0; of the token's fields, token, time, channels (how many)"
    )

    def check(self) -> None:
        for name, policy in (("weights", "random"), ("channel", "expression")):
            if getattr(self, name) is not None and self.policy != policy:
                raise ParameterError(f"{name}: it is for the policy {policy!r}, and the policy is {self.policy!r}")
        if self.policy == "expression" and self.channel is None:
            raise ParameterError("policy: 'expression' needs 'channel', which says which channel a token goes to")
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
                "'shortest queue' needs to be told of each"
            )
        if self._sums is not None and len(self._sums) != width:
            raise PortError(
                f"{self.output.path} has {counted(width, 'channel')}, and there are {len(self._sums)} weights"
            )
        self._loads = [0.0] * width

    def fire(self) -> None:
        if not self.output.width:
            return
        if self.load.present:
            for place, loads in enumerate(self.load.by_channel()):
                if loads:
                    self._loads[place] = loads[-1]
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
            number = of_token(self.channel, token, time=self.now, channels=width)
            if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number < width:
                raise EpicycleError(
                    f"{self.channel} gives {number!r} for {brief(token)}, but {self.output.path} has "
                    f"{counted(width, 'channel')}, counted from 0"
                )
            return number
        least = min(self._loads)
        places = [place for place, load in enumerate(self._loads) if load == least]
        place = places[self.random.below(len(places))] if len(places) > 1 else places[0]
        self._loads[place] += 1.0
        return place


class Switch(Actor):
    """Sends each token to the channel of its output that the latest ``control`` token names.

    Ptolemy: ``Switch``.
    """

    input = InputPort(doc="what is handed on")
    control = InputPort(int, doc="the number of the channel, from 0; 0 until a token comes")
    output = OutputPort(multi=True, doc="a channel for each connection, in their order")

    outside = Parameter(
        str,
        "error",
        choices=("error", "nothing"),
        ptolemy="nothing",
        doc="what is sent while control names no channel",
    )

    def initialize(self) -> None:
        self._channel = 0

    def fire(self) -> None:
        width = self.output.width
        if self.control.present and self.outside == "nothing":
            self._channel = self.control.value
        elif self.control.present:
            self._channel = _channel(self.control.value, self.control, width, "output")
        if self.outside == "error" or 0 <= self._channel < width:
            for token in self.input.tokens:
                self.output.send(token, self._channel)


class BooleanSwitch(Actor):
    """Sends each token to ``true_output`` or ``false_output``, as the latest ``control`` token says.

    With several connections of ``input``, each channel leads to that of the outputs with its number.
    Ptolemy: ``BooleanSwitch``, ``ConfigurationSwitch`` (whose ``selector`` is ``control``).
    """

    input = InputPort(multi=True, doc="what is handed on")
    true_output = OutputPort(multi=True, doc="the tokens that come while control is true")
    false_output = OutputPort(multi=True, doc="the tokens that come while control is false")

    control = PortParameter(bool, False, doc="where to")

    def fire(self) -> None:
        output = self.true_output if self.control else self.false_output
        for channel, tokens in enumerate(self.input.by_channel()):
            if self.input.width == 1 or channel < output.width:
                for token in tokens:
                    output.send(token, None if self.input.width == 1 else channel)


class Select(Actor):
    """Passes on the tokens of the channel that the latest ``control`` token names; those of the others are lost.

    If unread tokens are ``kept``, those of the others wait until they are chosen, and one goes on in each firing, which
    takes one token of ``control``; a number that names no channel chooses none.
    Ptolemy: ``Multiplexor`` and ``BooleanMultiplexor`` (true is channel 1), with tokens kept ``Select``.
    """

    input = InputPort(multi=True, doc="a channel for each connection, in their order")
    control = InputPort(int, doc="the number of the channel, from 0")
    output = OutputPort(doc="the tokens of the channel chosen")

    unread = Parameter(
        str, "lost", choices=("lost", "kept"), ptolemy="kept", doc="what becomes of tokens that are not chosen"
    )
    initial: Parameter[int | None] = Parameter(
        int, 0, min=0, optional=True, doc="the channel before the first token of control; none if null"
    )

    def check(self) -> None:
        self.input.keep = self.control.keep = self.unread == "kept"

    def initialize(self) -> None:
        self._channel = self.initial

    def fire(self) -> None:
        if self.unread == "kept":
            if self.control.waiting():
                self._channel = self.control.get()
            if (
                self._channel is not None
                and 0 <= self._channel < self.input.width
                and self.input.waiting(self._channel)
            ):
                self.output.send(self.input.get(self._channel))
            return
        if self.control.present:
            self._channel = _channel(self.control.value, self.control, self.input.width, "input")
        for token in () if self._channel is None else self.input.by_channel()[self._channel]:
            self.output.send(token)


class Repeat(Actor):
    """Sends each token several times.

    Ptolemy: ``Repeat``.
    """

    input = InputPort(doc="what is repeated")
    output = OutputPort(doc="each token, as often as told")

    times = PortParameter(int, 2, min=0, doc="how often each token is sent")

    def fire(self) -> None:
        for token in self.input.tokens:
            for _ in range(self.times):
                self.output.send(token)


class ByChannel(Actor):
    """What these actors share: an input and an output with channels that belong together."""

    input = InputPort(multi=True, doc="the streams")
    output = OutputPort(multi=True, doc="channel by channel what the input gets")

    def initialize(self) -> None:
        wanted, found = self.input.width, self.output.width
        if wanted > 1 and found not in (0, wanted):
            raise PortError(
                f"{self.input.path} has {wanted} channels and {self.output.path} has {found}; they must have "
                "equally many, for each channel of the input leads to one of the output"
            )

    def send(self, token: Any, channel: int) -> None:
        """Send what came on a channel."""
        if self.input.width == 1 or self.output.width == 0:
            self.output.send(token)
        else:
            self.output.send(token, channel)


class Sampler(ByChannel):
    """Passes on what comes at the same tag as a trigger; all other tokens are lost.

    Ptolemy: ``Sampler``.
    """

    trigger = InputPort(multi=True, doc="when to hand on")

    def fire(self) -> None:
        if self.trigger.present:
            for channel, tokens in enumerate(self.input.by_channel()):
                for token in tokens:
                    self.send(token, channel)


class MostRecent(ByChannel):
    """Sends the latest token of each channel whenever it is triggered, even if it has not changed: a zero-order hold.

    A channel on which no token has come yet sends ``initial``, or nothing if that is not given.
    Ptolemy: ``MostRecent``, ``ZeroOrderHold``.
    """

    trigger = InputPort(multi=True, doc="when to send; triggers that come together, one on each channel, are one")

    initial: Parameter[Any] = Parameter(object, None, doc="what is sent for a channel before its first token")

    def initialize(self) -> None:
        super().initialize()
        self._latest: list[Any] = [self.initial] * self.input.width

    def fire(self) -> None:
        self.note()
        self.send_latest()

    def note(self) -> None:
        """Take note of the latest tokens."""
        for channel, tokens in enumerate(self.input.by_channel()):
            if tokens:
                self._latest[channel] = tokens[-1]

    def send_latest(self) -> None:
        """Send them for each trigger."""
        for _ in rounds(self.trigger):
            for channel, token in enumerate(self._latest):
                if token is not None:
                    self.send(token, channel)


class Synchronizer(ByChannel):
    """Waits until there is a token on every channel, and then sends one of each at the same tag.

    Tokens wait in the order of their arrival.  Ptolemy: ``Synchronizer``.
    """

    def initialize(self) -> None:
        super().initialize()
        self._waiting: list[deque[Any]] = [deque() for _ in range(self.input.width)]

    def fire(self) -> None:
        for queue, tokens in zip(self._waiting, self.input.by_channel(), strict=True):
            queue.extend(tokens)
        while all(self._waiting):
            for channel, queue in enumerate(self._waiting):
                self.send(queue.popleft(), channel)


def _channel(number: int, control: InputPort[Any], width: int, name: str) -> int:
    if not 0 <= number < max(width, 1):
        raise PortError(f"{control.path} is {number}, but {name} has {counted(width, 'channel')}, counted from 0")
    return int(number)
