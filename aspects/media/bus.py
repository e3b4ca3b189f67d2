"""A bus that carries one message after the other."""

from __future__ import annotations

from typing import Any, ClassVar

from epicycle.actors import Parameter, to_nanoseconds, to_seconds

from ..core import JoinPoint
from .medium import Medium, Message, WaitingLine


class Bus(Medium):
    """Carries one message at a time, whatever its port: a server with one queue, by priority and not preemptive.

    The carriage of a message takes ``factor`` * length.  It arrives when that is over, and when that is at once it
    leaves no trace.  At the output of its sender a broadcast is carried once, at the inputs of its receivers once for
    each.  Events: ``delayed``, when it arrives, with the seconds since it came; ``dropped``, for want of a
    place.  Reported over the time from 0 to the end of the run: ``utilisation``, the share in which the bus carries;
    ``mean_wait``, the mean time from coming to the begin of carriage; ``mean_queue``, the mean number that wait.

    With Poisson arrivals at rate a and a constant carriage s it is M/D/1: utilisation r = a s and
    mean_wait = r s / (2 (1 - r)) (Pollaczek-Khinchine); with priorities, mean_wait of class k is
    r s / (2 (1 - r_1 - ... - r_k-1) (1 - r_1 - ... - r_k)) (Cobham, Operations Research 2, 1954); with ``capacity: 0``
    the share r / (1 + r) is dropped (Erlang).  Ptolemy: ``Bus``.
    """

    events: ClassVar[tuple[str, ...]] = ("delayed", "dropped")
    reports: ClassVar[dict[str, str]] = {"utilisation": "1", "mean_wait": "s", "mean_queue": "1"}

    factor = Parameter(float, min=0.0, unit="s", doc="time that it takes to carry a message of length 1")

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        bus: _Server = point.shared.setdefault("bus", _Server())
        now = point.tag.time
        duration = to_nanoseconds(self.factor * self.length_of(token))
        message = Message(self.priority_of(token), bus.come, token, point, duration)
        bus.come += 1
        if bus.carried is not None and bus.begun + bus.carried.duration <= now:
            bus.finish(bus.carried)  # which is over by now, though the director has not called yet
        if bus.is_idle and not bus.line:
            bus.begin(message)
        elif dropped := bus.line.add(message, self.capacity, self.overflow):
            dropped.point.act("dropped", dropped.token)

    def report(self, shared: dict[Any, Any], end: int) -> dict[str, float | None]:
        bus: _Server = shared.get("bus", _Server())
        return {
            "utilisation": bus.busy_until(end) / end if end else None,
            "mean_wait": to_seconds(bus.waited) / bus.begins if bus.begins else None,
            "mean_queue": bus.line.area(end) / end if end else None,
        }


class _Server:
    """What is on a bus, and what has been; times in ns."""

    def __init__(self) -> None:
        self.line: WaitingLine[Message] = WaitingLine()
        self.carried: Message | None = None
        self.begun = 0  # when the carriage of the carried one began
        self.come = 0  # messages
        self.begins = 0  # carriages
        self.waited = 0  # by all whose carriage has begun
        self._busy = 0  # by all whose carriage is over

    @property
    def is_idle(self) -> bool:
        """Whether it carries nothing."""
        return self.carried is None

    def begin(self, message: Message) -> None:
        """Carry a message, now."""
        now = message.point.tag.time
        self.carried, self.begun = message, now
        self.begins += 1
        self.waited += now - message.came
        if message.duration > 0:
            message.point.later(to_seconds(message.duration), self.finish, message)
        else:
            self._deliver(message)

    def finish(self, message: Message) -> None:
        """Deliver the carried message, if it still is this one, and go on with the next."""
        if message is self.carried:
            self._deliver(message)
            while self.is_idle and self.line:
                self.begin(self.line.pop(message.point.tag.time))

    def _deliver(self, message: Message) -> None:
        self._busy += message.duration
        self.carried = None
        message.arrive()

    def busy_until(self, end: int) -> int:
        """How long it was busy before ``end``, which is not before the present."""
        return self._busy + (end - self.begun if self.carried is not None else 0)
