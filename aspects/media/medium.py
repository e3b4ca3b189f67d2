"""Medium: what ports share; and the bus, which carries one message after the other."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from epicycle.actors import Parameter, to_nanoseconds, to_seconds

from ..core import NEWEST, OLDEST, CommunicationAspect, FieldError, JoinPoint, Server, Task, field_of, numbers_in


class Medium(CommunicationAspect):
    """Base of media: what takes place at one port changes what takes place at the others.

    Each message that passes a join point is one transmission.  At an output port, or at the input of a channel that
    copies to many, a broadcast is therefore carried once for all who hear it; at the inputs of n receivers, n times.

    All ports of a declaration share one medium.  Several declarations of one type (in one composite) share it, too, if
    they give it the same name: that is how different messages get different lengths and priorities.  A medium goes by
    the time of the model, for its ports may stand under different clocks.  Messages that wait go by priority, and in
    the order in which they came among equals.
    """

    stands_at: ClassVar[frozenset[str]] = frozenset({"input", "output"})
    in_model_time: ClassVar[bool] = True

    medium: Parameter[str | None] = Parameter(
        str, None, doc="name of the medium, which declarations of the same type share; none: one of its own"
    )
    message_length = Parameter(float, 1.0, min=0.0, doc="length of a message")
    number_length = Parameter(float, 0.0, min=0.0, doc="what each number in the message adds to its length")
    length_field: Parameter[str | None] = Parameter(
        str, None, doc="field of the message that holds its length, in place of both"
    )
    priority = Parameter(float, 0.0, doc="of the messages that wait, those with the smallest number go first")
    priority_field: Parameter[str | None] = Parameter(
        str, None, doc="field of the message that holds its priority, in place of priority"
    )
    capacity: Parameter[int | None] = Parameter(
        int, None, min=0, doc="how many messages can wait when one comes, the carried one not counted; none: any number"
    )
    overflow = Parameter(
        str, NEWEST, choices=(NEWEST, OLDEST), doc="which of the least urgent is dropped where there is no place"
    )

    def length_of(self, token: Any) -> float:
        """The length of a message; raises ``FieldError``."""
        if self.length_field is None:
            return self.message_length + (self.number_length * numbers_in(token) if self.number_length else 0.0)
        length = _number(token, self.length_field, "length")
        if length < 0.0:
            raise FieldError(f"{type(token).__name__}.{self.length_field} is {length:g}, but a length is >= 0")
        return length

    def priority_of(self, token: Any) -> float:
        """The priority of a message; raises ``FieldError``."""
        return self.priority if self.priority_field is None else _number(token, self.priority_field, "priority")


def _number(token: Any, name: str, role: str) -> float:
    value = field_of(token, name)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise FieldError(f"{type(token).__name__}.{name} is {value!r}, but the {role} of a message is a finite number")
    return float(value)


@dataclass(order=True)
class Message(Task):
    """A message that waits for a medium, or is carried by it."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self._release = self.point.hold(self.passing)

    def arrive(self) -> None:
        """Pass it on, and note how long it took."""
        taken = self.point.tag.time - self.came
        if taken > 0:
            self.point.act("delayed", self.passing, to_seconds(taken))
        self._release()


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
