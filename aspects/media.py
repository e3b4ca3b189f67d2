"""Shared media: messages at one port affect those at the others."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, ClassVar

from epicycle.actors import EpicycleError, Parameter, to_nanoseconds, to_seconds

from .core import (
    NEWEST,
    OLDEST,
    CommunicationAspect,
    FieldError,
    JoinPoint,
    Server,
    Task,
    WaitingLine,
    field_of,
    numbers_in,
)


class Medium(CommunicationAspect):
    """Base of media: messages at one port affect those at the others.

    Each message that passes a join point is one transmission.  At an output port, or at the input of a channel that
    copies to many, a broadcast is therefore carried once for all receivers; at the inputs of n receivers, n times.

    All ports of a declaration share one medium.  Several declarations of one type (in one composite) also share it if
    they give it the same name, so that different messages can have different lengths and priorities.  A medium uses the
    time of the model, because its ports may have different clocks.  Waiting messages go in order of priority, and among
    equals in order of arrival.
    """

    stands_at: ClassVar[frozenset[str]] = frozenset({"input", "output"})
    in_model_time: ClassVar[bool] = True

    medium = Parameter(
        str, None, doc="name of the medium, shared by declarations of the same type; if left out, a separate one"
    )
    message_length = Parameter(float, 1.0, min=0.0, doc="length of a message")
    number_length = Parameter(float, 0.0, min=0.0, doc="length added by each number in the message")
    length_field = Parameter(str, None, doc="field of the message that holds its length, instead of both")
    priority = Parameter(float, 0.0, doc="of the waiting messages, those with the smallest number go first")
    priority_field = Parameter(str, None, doc="field of the message that holds its priority, instead of priority")
    capacity = Parameter(
        int, None, min=0, doc="number of messages that can wait, without the carried one; unlimited if left out"
    )
    overflow = Parameter(
        str, NEWEST, choices=(NEWEST, OLDEST), doc="which of the least urgent messages is dropped if there is no place"
    )

    def length_of(self, token: Any) -> float:
        """The length of a message; raises ``FieldError``."""
        if self.length_field is None:
            return self.message_length + (self.number_length * numbers_in(token) if self.number_length else 0.0)
        length = _number(token, self.length_field, "length")
        if length < 0.0:
            raise FieldError(f"{type(token).__name__}.{self.length_field} is {length:g}, but a length must be >= 0")
        return length

    def priority_of(self, token: Any) -> float:
        """The priority of a message; raises ``FieldError``."""
        return self.priority if self.priority_field is None else _number(token, self.priority_field, "priority")


def _number(token: Any, name: str, role: str) -> float:
    value = field_of(token, name)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise FieldError(
            f"{type(token).__name__}.{name} is {value!r}, but the {role} of a message must be a finite number"
        )
    return float(value)


@dataclass(order=True)
class Message(Task):
    """A message that waits for a medium, or is carried by it."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self._pass_on = self.point.hold(self.passing)

    def release(self, now: int) -> None:
        if now > self.came:
            self.point.act("delayed", self.passing, to_seconds(now - self.came))
        self._pass_on()


class Bus(Medium):
    """Carries one message at a time for all its ports: a server with one queue, by priority and not preemptive.

    Carrying a message takes ``factor`` * length.  It arrives at the end of that time; if it takes no time, it leaves no
    trace.  At the output of its sender, a broadcast is carried once, at the
    inputs of its receivers once for each.  Events: ``delayed``, when it arrives, with the seconds since it came;
    ``dropped``, if there is no place.  Reported over the time from 0 to the end of the run: ``utilisation``, the share
    in which the bus is busy; ``mean_wait``, the mean time from arrival to the start of carrying; ``mean_queue``, the
    mean number of waiting messages.

    With Poisson arrivals at rate a and a constant carrying time s it is M/D/1: utilisation r = a s and mean_wait = r s
    / (2 (1 - r)) (Pollaczek-Khinchine); with priorities, mean_wait of class k is
    r s / (2 (1 - r_1 - ... - r_k-1) (1 - r_1 - ... - r_k)) (Cobham, Operations Research 2, 1954); with ``capacity: 0``
    the share r / (1 + r) is dropped (Erlang).  Ptolemy: ``Bus``.
    """

    events: ClassVar[tuple[str, ...]] = ("delayed", "dropped")
    reports: ClassVar[dict[str, str]] = {"utilisation": "1", "mean_wait": "s", "mean_queue": "1"}

    factor = Parameter(float, min=0.0, unit="s", doc="time to carry a message of length 1")

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        bus: Server = point.shared.setdefault("bus", self.server())
        duration = to_nanoseconds(self.factor * self.length_of(token))
        if dropped := bus.arrive(
            Message(self.priority_of(token), token, point, duration), self.capacity, self.overflow
        ):
            dropped.point.act("dropped", dropped.passing)

    def server(self) -> Server:
        """A new server."""
        return Server()

    def report(self, shared: dict[Any, Any], end: int) -> dict[str, float | None]:
        bus: Server = shared.get("bus", Server())
        return {
            "utilisation": bus.busy_until(end) / end if end else None,
            "mean_wait": to_seconds(bus.waited) / bus.begins if bus.begins else None,
            "mean_queue": bus.line.area(end) / end if end else None,
        }


class RadioMedium(Medium):
    """One radio channel that all stations hear: two that send at the same time spoil both messages.

    A *station* is the actor or composite whose port a message comes from (over the connection, for an aspect at an
    input).  It has one radio: it sends one message at a time, and up to ``capacity`` others wait.

    A transmission takes ``overhead`` + length / ``rate``.  Before it, the station draws a whole number of slots from 0
    to window - 1 and counts them down while the channel is idle.  A slot in which another station begins to send is
    counted; the next one begins when the channel is idle again (CSMA/CA).  Stations whose counts end together collide.
    The sender learns at the end whether the message came through; if not, it doubles its window, up to ``max_window``,
    and tries again, up to ``retries`` times (binary exponential backoff).  Without ``carrier_sense`` slots are always
    counted (ALOHA).

    Weave it where a broadcast passes once: at the output ports of the senders, or at the input of the channel actor
    that copies it.  There, airtime grows with the number of senders.  At the inputs of n receivers it is n
    transmissions, as from a radio that sends to one receiver after another.

    Events: ``delayed``, when a message arrives, with the seconds since it came; ``collided`` and ``lost``, for a failed
    transmission; ``dropped``, if there is no place or after the last retry.  Reported over the time from 0 to the end
    of the run: ``utilisation``, the share in which a station sends; ``throughput``, the share taken by successful
    transmissions; ``collision_rate``, the share of transmissions that collided; ``mean_delay``, the mean time from a
    message's entry to its arrival.

    Stations that always have something to send collide with probability p = 1 - (1 - t)^(n - 1), where
    t = 2 (1 - 2p) / ((1 - 2p) (W + 1) + p W (1 - (2p)^m)) for a window W that doubles m times (Bianchi, IEEE J. Sel.
    Areas Commun. 18, 2000; more accurate with more stations).  For many stations without carrier sense and retries,
    with Poisson arrivals of rate a and an airtime s, the share exp(-2 a s) comes through (Abramson, AFIPS 1970).
    A message without airtime passes at once.  Distances and walls are not modelled here: see ``RangeLoss``.
    """

    events: ClassVar[tuple[str, ...]] = ("delayed", "collided", "lost", "dropped")
    reports: ClassVar[dict[str, str]] = {
        "utilisation": "1",
        "throughput": "1",
        "collision_rate": "1",
        "mean_delay": "s",
    }

    message_length = Parameter(float, 0.0, min=0.0, unit="bit", doc="length of a message")
    number_length = Parameter(float, 0.0, min=0.0, unit="bit", doc="length added by each number in the message")
    rate = Parameter(float, above=0, unit="bit/s", doc="rate of transmission")
    overhead = Parameter(
        float, 0.0, min=0.0, unit="s", doc="additional time of each transmission: spacing, preamble, acknowledgement"
    )
    carrier_sense = Parameter(bool, True, doc="whether a station waits while another sends")
    slot = Parameter(float, 9e-6, above=0, unit="s", doc="slot time of the backoff; IEEE 802.11: 9 or 20 us")
    window = Parameter(int, 16, min=1, max=65536, doc="slots of the first backoff; 1: no backoff")
    max_window = Parameter(int, 1024, min=1, max=65536, doc="slots of the longest backoff")
    retries = Parameter(
        int, 7, min=0, doc="further attempts for a message; 0 for broadcasts, which are not acknowledged in IEEE 802.11"
    )
    capture = Parameter(
        float, 0.0, min=0.0, max=1.0, unit="1", doc="probability that the first of the colliding messages comes through"
    )
    loss = Parameter(float, 0.0, min=0.0, max=1.0, unit="1", doc="probability that noise spoils a transmission")

    def check(self) -> None:
        if self.max_window < self.window:
            raise EpicycleError(
                f"max_window is {self.max_window} and window is {self.window}: max_window must not be below window"
            )
        if self.length_field is None and not (self.message_length or self.number_length or self.overhead):
            raise EpicycleError("messages take no time: give message_length, number_length, length_field or overhead")

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        airtime = to_nanoseconds(self.overhead + self.length_of(token) / self.rate)
        if airtime == 0:
            point.forward(token)
            return
        air: _Air = point.shared.setdefault("air", _Air())
        station = air.stations.setdefault(point.source.rpartition(".")[0], _Station())
        frame = _Frame(self.priority_of(token), token, point, airtime, self, station)
        frame.number, air.come = air.come, air.come + 1
        if not station.is_busy:
            station.is_busy = True
            air.contend(frame)
        elif dropped := station.line.add(frame, frame.came, self.capacity, self.overflow):
            dropped.point.act("dropped", dropped.passing)

    def report(self, shared: dict[Any, Any], end: int) -> dict[str, float | None]:
        air: _Air = shared.get("air", _Air())
        return {
            "utilisation": air.busy_until(end) / end if end else None,
            "throughput": air.useful / end if end else None,
            "collision_rate": air.collisions / air.transmissions if air.transmissions else None,
            "mean_delay": to_seconds(air.delays) / air.arrivals if air.arrivals else None,
        }


class _Station:
    """One sender, with its waiting messages; it is busy while it handles another message."""

    def __init__(self) -> None:
        self.line: WaitingLine[_Frame] = WaitingLine()
        self.is_busy = False


@dataclass(order=True)
class _Frame(Message):
    """A message and its attempts; times in ns."""

    radio: RadioMedium = field(compare=False)  # that declared it
    station: _Station = field(compare=False)
    attempt: int = field(default=0, compare=False)
    slots: int = field(default=0, compare=False)  # slots of its backoff still to be counted
    since: int | None = field(default=None, compare=False)  # when counting began; None while the channel is not idle
    begun: int = field(default=0, compare=False)  # when its transmission began
    collided: bool = field(default=False, compare=False)
    is_first: bool = field(default=False, compare=False)  # the one of the colliding messages that can be captured

    @property
    def slot(self) -> int:
        return to_nanoseconds(self.radio.slot)

    @property
    def due(self) -> int | None:
        """When its transmission begins, unless another begins before."""
        return None if self.since is None else self.since + self.slots * self.slot

    @property
    def end(self) -> int:
        """When its transmission ends."""
        return self.begun + self.duration


class _Air:
    """The channel: it is called when the next transmission begins or ends, and handles all consequences."""

    def __init__(self) -> None:
        self.stations: dict[str, _Station] = {}
        self.contending: list[_Frame] = []
        self.sending: list[_Frame] = []
        self.come = 0  # messages
        self.transmissions = 0  # that are over
        self.collisions = 0  # of these
        self.arrivals = 0  # of messages
        self.delays = 0  # of these, in ns
        self.useful = 0  # their airtime (ns)
        self._busy = 0  # ns of sending, until the channel was last idle
        self._busy_since = 0
        self._next: int | None = None  # when it is called next

    def busy_until(self, end: int) -> int:
        """How long a station sent before ``end``, which is not before the present (ns)."""
        return self._busy + (end - self._busy_since if self.sending else 0)

    def contend(self, frame: _Frame) -> None:
        """Begin the backoff before a transmission."""
        window = min(frame.radio.window << min(frame.attempt, 20), frame.radio.max_window)
        frame.slots = frame.point.random.below(window)
        frame.since = None if self.sending and frame.radio.carrier_sense else frame.point.tag.time
        self.contending.append(frame)
        self._call_again(frame.point)

    def _call_again(self, point: JoinPoint) -> None:
        """Make sure that it is called at the next begin or end."""
        starts = [due for frame in self.contending if (due := frame.due) is not None]
        upcoming = min([*starts, *(frame.end for frame in self.sending)], default=None)
        if upcoming is not None and (self._next is None or upcoming < self._next):
            self._next = upcoming
            point.later(to_seconds(upcoming - point.tag.time), self._settle, (upcoming, point))

    def _settle(self, what: tuple[int, JoinPoint]) -> None:
        """End transmissions that are over, then begin those that are due."""
        now, point = what
        if now != self._next:  # another call has replaced this one
            return
        self._next = None
        over = [frame for frame in self.sending if frame.end == now]
        self.sending = [frame for frame in self.sending if frame.end != now]
        if over and not self.sending:
            self._busy += now - self._busy_since
            for frame in self.contending:
                frame.since = now if frame.since is None else frame.since
        for frame in over:
            self._end(frame, now)
        if due := [frame for frame in self.contending if frame.due == now]:
            self._begin(due, now)
        self._call_again(point)

    def _begin(self, due: list[_Frame], now: int) -> None:
        """Begin transmissions together."""
        self.contending = [frame for frame in self.contending if frame not in due]
        if not self.sending:
            self._busy_since = now
            # Of those that begin at the same time, none is first by its place in the model.
            first = due[0].point.random.below(len(due)) if len(due) > 1 else 0
            due[first].is_first = True
        for frame in due:
            frame.begun = now
        self.sending += due
        if len(self.sending) > 1:
            for frame in self.sending:
                frame.collided = True
        for frame in self.contending:
            if frame.since is not None and frame.radio.carrier_sense:
                frame.slots -= (now - frame.since) // frame.slot + 1  # the present slot is counted
                frame.since = None

    def _end(self, frame: _Frame, now: int) -> None:
        """Handle a message at the end of its transmission."""
        radio, point = frame.radio, frame.point
        captured, spoilt = point.random.random(2) < (radio.capture, radio.loss)
        in_vain = frame.collided and not (captured and frame.is_first)
        self.transmissions += 1
        self.collisions += frame.collided
        frame.collided = frame.is_first = False
        if in_vain or spoilt:
            point.act("collided" if in_vain else "lost", frame.passing)
            if frame.attempt < radio.retries:
                frame.attempt += 1
                self.contend(frame)
                return
            point.act("dropped", frame.passing)
        frame.station.is_busy = bool(frame.station.line.tasks)
        if frame.station.is_busy:
            self.contend(frame.station.line.pop(now))
        if not (in_vain or spoilt):
            self.arrivals += 1
            self.delays += now - frame.came
            self.useful += frame.duration
            frame.release(now)
