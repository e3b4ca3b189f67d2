"""Networks: Link, NetworkSwitch, and both ends of an ARQ protocol, ArqSender and ArqReceiver."""

from __future__ import annotations

import math
from bisect import insort
from collections import deque
from dataclasses import dataclass
from operator import itemgetter
from typing import Any

from .core import (
    Actor,
    EpicycleError,
    InputPort,
    OutputPort,
    Parameter,
    Pending,
    PortParameter,
    Tally,
    Wake,
    below_nanoseconds,
    brief,
    to_nanoseconds,
)
from .expression import TokenFormulaParameter, field_of
from .flow import channel_of
from .resources import Waiter, Waiters


class _Transmitter:
    """The sending end of a wire: frames that wait, in order, and whether one is being sent."""

    def __init__(self) -> None:
        self.waiting = Waiters()
        self.is_busy = False
        self.rest = 0.0  # rounding to whole nanoseconds, in s, added up while it was busy


class _Transmitting(Actor):
    """The common part of a link and a switch: a transmitter for each channel of the output."""

    rate = PortParameter(
        float, None, unit="bit/s", above=0, doc="rate at which frames are sent; without delay if left out"
    )
    size = TokenFormulaParameter(
        "1", known=("time",), doc="length of a frame in bits: an expression over its fields, token, time"
    )
    order = TokenFormulaParameter(
        "0",
        known=("time",),
        doc="of waiting frames, the one with the lowest value is sent first: an expression like size",
    )
    buffer = Parameter(
        float, None, unit="bit", min=0, doc="most bits that may wait, without the frame that is being sent"
    )

    def initialize(self) -> None:
        self._transmitters = [_Transmitter() for _ in range(max(self.outputs["output"].width, 1))]
        self._sent: Pending[tuple[int, Any]] = Pending(self)  # frames, with their channels, until they have been sent
        self._came = self._waits = 0  # frames
        self._count = Tally(self.outputs["waiting"])

    def _finish(self) -> list[tuple[int, Any]]:
        """The frames that have been sent, each with its channel."""
        found = self._sent.due()
        if len(found) > 1:
            found.sort(key=itemgetter(0))
        for channel, _ in found:
            self._transmitters[channel].is_busy = False
        return found

    def _enqueue(self, token: Any, channel: int, now: float) -> bool:
        """Let a frame wait for its channel; returns whether there is room for it."""
        transmitter = self._transmitters[channel]
        size = self.size.number("a size", token, now)
        if size < 0:
            raise EpicycleError(f"{self.size} gives {size:g} for {brief(token)}, but a size must be >= 0")
        order = self.order.number("an order", token, now)
        frame = Waiter(token, channel, order, float(self._came), size, self._came)
        self._came += 1
        self._waits += 1
        transmitter.waiting.add(frame)
        if self.buffer is not None:
            sizes = [each.size for each in transmitter.waiting]
            if math.fsum(sizes if transmitter.is_busy else sizes[1:]) > self.buffer:
                transmitter.waiting.remove(frame)
                self._waits -= 1
                return False
        return True

    def _begin(self, channel: int) -> None:
        """Let a transmitter continue, unless it is busy."""
        transmitter = self._transmitters[channel]
        if transmitter.is_busy:
            return
        if not transmitter.waiting:
            transmitter.rest = 0.0
            return
        frame = transmitter.waiting.pop(0)
        self._waits -= 1
        assert self.rate is not None
        time = frame.size / self.rate + transmitter.rest
        transmitter.rest = below_nanoseconds(time)
        transmitter.is_busy = True
        self._sent.put((channel, frame.token), time)


class Link(_Transmitting):
    """A link in one direction: frames wait, are sent one by one at ``rate``, and arrive after ``delay``.

    A frame takes ``size / rate`` to be sent; then it is lost with probability ``loss``, or travels for ``delay``,
    independently of later frames.  With Poisson arrivals and frames of equal length, the wait is that of M/D/1.  At one
    tag, a frame that has been sent makes room before others come in.  The output does not depend on the input within
    the same tag, so the actor may be part of a loop. Source: Bertsekas and Gallager, Data Networks.
    """

    input = InputPort(multi=True, doc="frames")
    output = OutputPort(depends_on=(), doc="each frame at the other end")
    lost = OutputPort(depends_on=(), doc="frames lost on the way, sent when their transmission ends")
    rejected = OutputPort(doc="frames that found the buffer full")
    waiting = OutputPort(int, doc="number of waiting frames, whenever it changes")

    delay = PortParameter(float, 0.0, unit="s", min=0, doc="propagation delay")
    loss = PortParameter(float, 0.0, unit="1", min=0, max=1, doc="probability that a frame is lost")

    def initialize(self) -> None:
        super().initialize()
        self._transmitters = self._transmitters[:1]
        self._travelling: Pending[tuple[bool, Any]] = Pending(self)

    def fire(self) -> None:
        for is_lost, token in self._travelling.due():
            (self.lost if is_lost else self.output).send(token)
        for _, token in self._finish():
            self._travel(token)
        for token in self.input.tokens:
            if self.rate is None:
                self._travel(token)
            elif not self._enqueue(token, 0, self.now):
                self.rejected.send(token)
        self._begin(0)
        self._count.tell(self._waits)

    def _travel(self, token: Any) -> None:
        is_lost = self.loss > 0 and self.random.random() < self.loss
        self._travelling.put((is_lost, token), 0.0 if is_lost else self.delay)


class NetworkSwitch(_Transmitting):
    """A store-and-forward switch: each frame goes to the channel of the output given by ``port``, and waits there.

    ``port: destination`` takes the channel from a field; ``port: "[0, 0, 1][destination]"`` is a table.  Each channel
    of the output sends its frames one by one at ``rate``, in the order of ``order`` (``order: -priority``), and has its
    own ``buffer``.  ``latency`` is how long the switch takes to find the channel.  The output does not depend on the
    input within the same tag, so the actor may be part of a loop.  Source: IEEE 802.1Q, strict priority.
    """

    input = InputPort(multi=True, doc="frames, on any channel")
    output = OutputPort(multi=True, depends_on=(), doc="the frames, on the channel given by 'port'")
    rejected = OutputPort(depends_on=(), doc="frames that found the buffer of their channel full")
    waiting = OutputPort(int, depends_on=(), doc="total number of waiting frames, whenever it changes")

    port = TokenFormulaParameter(
        known=("time",), doc="the channel of the output, from 0: an expression over the frame's fields, token, time"
    )
    latency = Parameter(float, 0.0, unit="s", min=0, doc="processing time of a frame; 0 is a microstep")

    def initialize(self) -> None:
        super().initialize()
        self._looked_at: Pending[Any] = Pending(self)

    def fire(self) -> None:
        width = self.output.width
        free = []  # channels that may continue
        for channel, token in self._finish():
            self.output.send(token, channel if width > 1 else None)
            free.append(channel)
        for token in self._looked_at.due():
            now = self.now
            channel = channel_of(token, self.port, self.output, now)
            if self.rate is None:
                self.output.send(token, channel if width > 1 else None)
            elif self._enqueue(token, channel, now):
                free.append(channel)
            else:
                self.rejected.send(token)
        for channel in free:
            self._begin(channel)
        for token in self.input.tokens:
            self._looked_at.put(token, self.latency)
        self._count.tell(self._waits)


@dataclass(slots=True)
class _Outgoing:
    """A token that an ARQ sender has not got rid of."""

    token: Any
    end: Wake | None  # of its lifetime
    timeouts: int = 0

    @property
    def is_dead(self) -> bool:
        """Whether its lifetime ends now."""
        return self.end is not None and self.end.due


class ArqSender(Actor):
    """The sending end of an automatic repeat request: keeps frames until they are acknowledged, and repeats them.

    A frame is ``{number, data}``, where data is the incoming token.  ``window: 1`` is stop-and-wait.  Otherwise, when
    the oldest frame has not been acknowledged for ``timeout``, ``repeat: all`` sends all outstanding frames again (go
    back N), and ``repeat: one`` each frame whose own timeout has elapsed (selective repeat).  An acknowledgement is the
    number of a frame: with ``all`` it acknowledges all frames up to this one, with ``one`` only this one.  Frames go
    through a lossy ``Link`` to an ``ArqReceiver``, whose acknowledgements return by another.  The output does not
    depend on ``ack`` within the same tag.

    With a limit of ``tries`` or a ``lifetime``, the sender abandons tokens; each may have arrived all the same.  The
    frames then have a third field, the ``oldest`` number that may still come, and the receiver waits for none before
    it.  If no frame is due when a token is abandoned, ``{oldest}`` is sent alone, once; should it be lost, the receiver
    learns of it from the next frame.  With ``repeat: all``, a timeout counts as a try of the oldest frame alone,
    because the others are discarded for its sake.

    Sources: Bertsekas and Gallager, Data Networks, 2.4; Tanenbaum, Computer Networks, 3.4; RFC 3758 (partial
    reliability).
    """

    input = InputPort(doc="tokens to deliver")
    ack = InputPort(int, doc="numbers of frames that have arrived")
    output: OutputPort[Any] = OutputPort(dict, depends_on=(), doc="frames: {number, data} or {number, data, oldest}")
    acknowledged = OutputPort(depends_on=(), doc="the tokens that are known to have arrived")
    abandoned = OutputPort(depends_on=(), doc="the tokens that were given up")
    repeated = OutputPort(int, depends_on=(), doc="the number of each frame that is sent again")
    waiting = OutputPort(
        int, depends_on=(), doc="number of tokens that wait for the window to move, whenever it changes"
    )

    window = Parameter(int, 1, min=1, doc="most frames that may be unacknowledged")
    timeout = PortParameter(float, unit="s", above=0, doc="how long to wait for an acknowledgement")
    spacing = Parameter(
        float, 0.0, unit="s", min=0, doc="shortest time from one frame to the next, such as the time that a link takes"
    )
    repeat = Parameter(
        str, "all", choices=("all", "one"), doc="what is sent again: all outstanding frames, or those that are late"
    )
    tries = Parameter(
        int, None, min=1, doc="number of timeouts after which a token is abandoned; unlimited if left out"
    )
    lifetime = Parameter(
        float, None, unit="s", above=0, doc="age at which a token is abandoned, sent or not; unlimited if left out"
    )

    def initialize(self) -> None:
        self._queue: deque[_Outgoing] = deque()
        self._acks: list[int] = []
        self._out: dict[int, _Outgoing] = {}  # by number, the oldest first
        self._late: dict[int, Wake] = {}  # of sent frames: when they are late
        self._ahead: list[int] = []  # frames to be sent, the oldest first
        self._next = 0  # number
        self._sent = -1  # of the latest frame sent for the first time
        self._is_told = True  # whether the receiver was told of all that was abandoned
        self._free = 0  # when (ns) the next may be sent
        self._wake: Wake | None = None
        self._count = Tally(self.waiting)

    def fire(self) -> None:
        late = [number for number, wake in self._late.items() if wake.due]
        if late:
            self._line_up(late)
        if (self.tries is not None or self.lifetime is not None) and self._abandon():
            self._open()
            self._send()
        elif late:
            self._send()
        if self._wake is not None and self._wake.due:
            self._wake = None
            self._acknowledge()
            self._open()
            self._send()
        if self.input.present or self.ack.present:
            for token in self.input.tokens:
                self._queue.append(_Outgoing(token, None if self.lifetime is None else self.wake_in(self.lifetime)))
            self._acks.extend(self.ack.tokens)
            self._ask(self.context.time)

    def _ask(self, time: int) -> None:
        """Make sure that it continues at a time (ns) or earlier."""
        if self._wake is None or self._wake.time > time:
            if self._wake is not None:
                self._wake.cancel()
            self._wake = self.context.wake(self, time)

    def _line_up(self, late: list[int]) -> None:
        """Send frames again: those that are late, or all."""
        for number in late:
            if self.repeat == "one" or number == self._oldest:
                self._out[number].timeouts += 1
        for number in list(self._late) if self.repeat == "all" else late:
            self._late.pop(number).cancel()
            insort(self._ahead, number)

    def _abandon(self) -> bool:
        """Give up the tokens that have reached a limit; returns whether there are any."""
        over = [number for number, each in self._out.items() if each.is_dead or each.timeouts == self.tries]
        for number in over:
            self.abandoned.send(self._taken_out(number))
            self._is_told = False
        count = len(self._queue)
        while self._queue and self._queue[0].is_dead:
            self.abandoned.send(self._queue.popleft().token)
        return bool(over) or len(self._queue) < count

    def _acknowledge(self) -> None:
        for number in self._acks:
            meant = [each for each in self._out if each <= number] if self.repeat == "all" else [number]
            for each in meant:
                if each in self._out:
                    self.acknowledged.send(self._taken_out(each))
        self._acks = []

    def _taken_out(self, number: int) -> Any:
        """Forget a frame; returns its token."""
        if number in self._late:
            self._late.pop(number).cancel()
        else:
            self._ahead.remove(number)
        frame = self._out.pop(number)
        if frame.end is not None:
            frame.end.cancel()
        return frame.token

    @property
    def _oldest(self) -> int:
        """The lowest number that may still be sent."""
        return next(iter(self._out), self._next)

    def _open(self) -> None:
        """Let in as many as the window has room for."""
        while self._queue and self._next - self._oldest < self.window:
            self._out[self._next] = self._queue.popleft()
            self._ahead.append(self._next)
            self._next += 1
        self._count.tell(len(self._queue))

    def _send(self) -> None:
        limit = {} if self.tries is None and self.lifetime is None else {"oldest": self._oldest}
        now = self.context.time
        while (self._ahead or not self._is_told) and self._free <= now:
            self._free = now + to_nanoseconds(self.spacing)
            self._is_told = True
            if not self._ahead:
                self.output.send(limit)
                break
            number = self._ahead.pop(0)
            self._late[number] = self.wake_in(self.timeout)
            self.output.send({"number": number, "data": self._out[number].token, **limit})
            if number <= self._sent:
                self.repeated.send(number)
            self._sent = max(self._sent, number)
        if self._ahead or not self._is_told:
            self._ask(self._free)


class ArqReceiver(Actor):
    """The receiving end of an automatic repeat request: passes on the tokens of an ``ArqSender``, once and in order.

    With ``repeat: all``, a frame that is not the next one is discarded, and the last one in order is acknowledged; with
    ``one``, it is kept until its turn, and each frame is acknowledged separately.  A frame may name the ``oldest``
    number that may still come: then it waits for none before that.  Sources: see ``ArqSender``.
    """

    input: InputPort[Any] = InputPort(dict, doc="frames: {number, data}, also with oldest; or {oldest}")
    output = OutputPort(doc="their data, in order")
    ack = OutputPort(int, doc="acknowledgements for the sender: numbers of frames")

    repeat = Parameter(str, "all", choices=("all", "one"), doc="as for the sender")

    def initialize(self) -> None:
        self._expected = 0
        self._kept: dict[int, Any] = {}

    def fire(self) -> None:
        for frame in self.input.tokens:
            if "oldest" in frame:
                self._skip_to(_number_of(frame, "oldest"))
                if "number" not in frame:
                    continue
            number, data = _number_of(frame, "number"), field_of(frame, "data")
            if number == self._expected or (number > self._expected and self.repeat == "one"):
                self._kept[number] = data
            self._deliver()
            if self.repeat == "one":
                self.ack.send(number)
            elif self._expected:
                self.ack.send(self._expected - 1)

    def _skip_to(self, oldest: int) -> None:
        for number in sorted(each for each in self._kept if each < oldest):
            self.output.send(self._kept.pop(number))
        self._expected = max(self._expected, oldest)
        self._deliver()

    def _deliver(self) -> None:
        while self._expected in self._kept:
            self.output.send(self._kept.pop(self._expected))
            self._expected += 1


def _number_of(frame: Any, field: str) -> int:
    number = field_of(frame, field)
    if isinstance(number, bool) or not isinstance(number, int):
        which = "number" if field == "number" else "oldest number"
        raise EpicycleError(f"the {which} of a frame is {number!r}, expected 0, 1, 2, ...")
    return number
