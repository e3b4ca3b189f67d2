"""Common needs of authors of actors: tokens that belong together, and work that waits for its time.

The k-th tokens of all channels form the k-th round, so one token per channel and tag gives one round.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from itertools import zip_longest
from types import MappingProxyType
from typing import Any, Generic, TypeVar

from .actor import Actor
from .order import TimedQueue
from .ports import InputPort, OutputPort
from .tag import to_nanoseconds

T = TypeVar("T")
ABSENT: Any = type("_Absent", (), {"__repr__": lambda self: "absent"})()


def rounds(*ports: InputPort[Any]) -> Iterator[list[list[Any]]]:
    """The tokens of the present tag round by round: for each port a list with an entry per channel, or ``ABSENT``."""
    channels = [channel for port in ports for channel in port.by_channel()]
    for tokens in zip_longest(*channels, fillvalue=ABSENT):
        entries = iter(tokens)
        yield [[next(entries) for _ in range(port.width)] for port in ports]


def present(tokens: Sequence[Any]) -> list[Any]:
    """The tokens without ``ABSENT``."""
    return [token for token in tokens if token is not ABSENT]


class Queues:
    """The tokens of inputs that wait until they are taken: a queue for each channel, one input after the other."""

    def __init__(self, *ports: InputPort[Any]) -> None:
        self._ports = ports
        self.channels: list[deque[Any]] = [deque() for port in ports for _ in range(port.width)]

    def come(self) -> None:
        """Let the tokens of the present tag wait."""
        first = 0
        for port in self._ports:
            for channel, token in port.arrivals():
                self.channels[first + channel].append(token)
            first += port.width

    def rounds(self) -> Iterator[list[Any]]:
        """Let them wait, and take one from each channel as long as all have one."""
        self.come()
        while self.channels and all(self.channels):
            yield [queue.popleft() for queue in self.channels]


class Latest:
    """Keeps the latest token of each of several single inputs, for actors that need all of them at once.

    An input that is held (all with ``hold``, or those that it names) has its latest token in a round that brings none,
    and before the first one what it is to ``start`` with; a round in which another input lacks a token gives nothing.
    """

    def __init__(
        self,
        ports: Iterable[InputPort[Any]],
        *,
        hold: bool | Collection[str],
        start: Mapping[str, Any] = MappingProxyType({}),
    ) -> None:
        # An optional input without connections is left out.
        self._ports = [port for port in ports if port.width]
        names = [port.name for port in self._ports]
        self._fleeting = [name for name in names if not (hold if isinstance(hold, bool) else name in hold)]
        self._tokens: dict[str, Any] = dict(start)
        self._count = len({*names, *start})

    def rounds(self) -> Iterator[dict[str, Any]]:
        """The values by the names of the ports, for each round in which every connected input has one."""
        for entries in rounds(*self._ports):
            for name in self._fleeting:
                self._tokens.pop(name, None)
            for port, (token,) in zip(self._ports, entries, strict=True):
                if token is not ABSENT:
                    self._tokens[port.name] = token
            if len(self._tokens) == self._count:
                yield dict(self._tokens)


class Tally:
    """A number that an output tells whenever it changes; 0 at first."""

    __slots__ = ("_output", "number")

    def __init__(self, output: OutputPort[int]) -> None:
        self._output = output
        self.number = 0

    def tell(self, number: int) -> None:
        """Send the number, if it is another one."""
        if number != self.number:
            self.number = number
            self._output.send(number)


class Pending(Generic[T]):
    """Values that wait for their time: ``put`` them in ``fire``, and take those that are due with ``due``."""

    __slots__ = ("_actor", "_line")

    def __init__(self, actor: Actor) -> None:
        self._actor = actor
        self._line = TimedQueue()

    def __len__(self) -> int:
        return len(self._line)

    def put(self, value: T, delay: float) -> None:
        """Keep a value for ``delay`` seconds; 0 is the next microstep."""
        actor = self._actor
        context = actor.context
        self._line.push(context.wake(actor, context.time + to_nanoseconds(delay)), value)

    def due(self) -> list[T]:
        """Take the values whose time is the present tag, in the order in which they were put."""
        return self._line.due()
