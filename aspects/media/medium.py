"""Medium: what ports share, and messages that wait for it."""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass, field
from typing import Any, ClassVar, Generic, TypeVar

from epicycle.actors import Parameter, to_seconds

from ..core import CommunicationAspect, FieldError, JoinPoint, field_of, numbers_in

NEWEST, OLDEST = "newest", "oldest"


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
class Message:
    """A message that waits for a medium, or is carried by it; times in ns."""

    priority: float
    number: int  # which of all that have come
    token: Any = field(compare=False)
    point: JoinPoint = field(compare=False)
    duration: int = field(compare=False)  # of its carriage

    def __post_init__(self) -> None:
        self.came = self.point.tag.time
        self._release = self.point.hold(self.token)

    def arrive(self) -> None:
        """Pass it on, and note how long it took."""
        taken = self.point.tag.time - self.came
        if taken > 0:
            self.point.act("delayed", self.token, to_seconds(taken))
        self._release()


M = TypeVar("M", bound=Message)


class WaitingLine(Generic[M]):
    """Messages that wait, the most urgent first, and in the order in which they came among equals."""

    def __init__(self) -> None:
        self._heap: list[M] = []
        self._area = 0  # the integral of the number of messages over time (ns)
        self._since = 0

    def __len__(self) -> int:
        return len(self._heap)

    def area(self, now: int) -> int:
        """The integral of the number of messages from time 0 to the present, in ns."""
        self._area += len(self._heap) * (now - self._since)
        self._since = now
        return self._area

    def add(self, message: M, capacity: int | None, overflow: str) -> M | None:
        """Let a message wait; returns the one that is dropped for it, which can be itself."""
        self.area(message.came)
        heapq.heappush(self._heap, message)
        if capacity is None or len(self._heap) <= capacity:
            return None
        least = max(each.priority for each in self._heap)
        choose = max if overflow == NEWEST else min
        dropped = choose((each for each in self._heap if each.priority == least), key=lambda each: each.number)
        self._heap.remove(dropped)
        heapq.heapify(self._heap)
        return dropped

    def pop(self, now: int) -> M:
        """The message whose turn it is."""
        self.area(now)
        return heapq.heappop(self._heap)
