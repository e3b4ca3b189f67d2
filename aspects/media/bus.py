"""A bus that carries one message after the other."""

from __future__ import annotations

from typing import Any, ClassVar

from epicycle.actors import Parameter, to_nanoseconds, to_seconds

from ..core import JoinPoint, Server
from .medium import Medium, Message


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
        bus: _Carrier = point.shared.setdefault("bus", _Carrier())
        duration = to_nanoseconds(self.factor * self.length_of(token))
        if dropped := bus.arrive(
            Message(self.priority_of(token), token, point, duration), self.capacity, self.overflow
        ):
            dropped.point.act("dropped", dropped.passing)

    def report(self, shared: dict[Any, Any], end: int) -> dict[str, float | None]:
        bus: _Carrier = shared.get("bus", _Carrier())
        return {
            "utilisation": bus.busy_until(end) / end if end else None,
            "mean_wait": to_seconds(bus.waited) / bus.begins if bus.begins else None,
            "mean_queue": bus.line.area(end) / end if end else None,
        }


class _Carrier(Server[Message]):
    """What is on a bus, and what has been."""

    def release(self, task: Message, now: int) -> None:
        task.arrive()
