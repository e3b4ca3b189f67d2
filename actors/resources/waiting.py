"""What a pool and a waiting line share: those that wait, in which order, and why some leave before their turn."""

from __future__ import annotations

import math
from bisect import bisect_left, insort
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, ClassVar, Final

from ..core import Actor, EpicycleError, Parameter, ParameterError, Pending, PortError, Wake
from ..distributions import Distribution
from ..expression import FormulaParameter, number_of_token, of_token

FIFO: Final = "fifo"
LIFO: Final = "lifo"
RANDOM: Final = "random"


@dataclass(eq=False)
class Waiter:
    """A token that waits, or that has what it has waited for."""

    token: Any
    channel: int
    order: float
    place: float  # among those of the same order
    size: float
    number: int  # no two have the same
    amount: int = 1  # of units that it asks for
    patience: Wake | None = None

    @property
    def key(self) -> tuple[float, float, int]:
        """The lower one goes first."""
        return self.order, self.place, self.number


class Waiters:
    """Those that wait, in the order in which they go."""

    def __init__(self) -> None:
        self._all: list[Waiter] = []

    def __len__(self) -> int:
        return len(self._all)

    def __iter__(self) -> Iterator[Waiter]:
        return iter(self._all)

    def add(self, waiter: Waiter) -> None:
        """Let one wait at its place."""
        insort(self._all, waiter, key=lambda each: each.key)

    def remove(self, waiter: Waiter) -> None:
        """Let one go."""
        place = bisect_left(self._all, waiter.key, key=lambda each: each.key)
        del self._all[place]
        if waiter.patience is not None:
            waiter.patience.cancel()
            waiter.patience = None

    def __contains__(self, waiter: Waiter) -> bool:
        place = bisect_left(self._all, waiter.key, key=lambda each: each.key)
        return place < len(self._all) and self._all[place] is waiter

    @property
    def first(self) -> Waiter:
        """Who goes next."""
        return self._all[0]


class WaitingActor(Actor):
    """Base of actors in which tokens wait for their turn.

    What comes at a tag is dealt with together, and told at the next microstep: the actor may stand in a loop.  A child
    has the outputs ``rejected``, ``balked``, ``reneged`` and ``waiting``.
    """

    entrance: ClassVar[str]  # the input by which tokens come

    discipline = Parameter(
        str, FIFO, choices=(FIFO, LIFO, RANDOM), doc="of equals: who came first, who came last, or one at random"
    )
    order = FormulaParameter("0", doc="the least goes first; of the token's fields, token, time, channel")
    room: Parameter[float | None] = Parameter(float, None, min=0, doc="how much may wait; any number if left out")
    balking: Parameter[Any] = FormulaParameter(
        None,
        doc="condition or probability to turn away, of one that has to wait; of its fields, and waiting (a number)",
    )
    patience: Parameter[Distribution | None] = Parameter(
        Distribution, None, unit="s", doc="how long one waits until it reneges; for ever if left out"
    )

    def check(self) -> None:
        if self.patience is not None and self.patience.token_type not in (int, float):
            raise ParameterError(f"patience: {type(self.patience).__name__} does not give numbers alone")

    def initialize(self) -> None:
        self._waiting = Waiters()
        self._told: Pending[tuple[str, Any, int | None]] = Pending(self)
        self._counts: dict[str, int] = {}  # what was told of them
        self._came = 0

    def _tell(self, port: str, token: Any, channel: int | None = None) -> None:
        """Send at the next microstep."""
        self._told.put((port, token, channel), 0.0)

    def _tell_of(self, port: str, waiter: Waiter) -> None:
        output = self.outputs[port]
        is_answer = output.multi and output.width == self.inputs[self.entrance].width
        self._tell(port, waiter.token, waiter.channel if is_answer else None)

    def _tell_count(self, port: str, count: int) -> None:
        if self._counts.get(port, 0) != count:
            self._counts[port] = count
            self._tell(port, count)

    def _send(self) -> None:
        """Send what was to be told."""
        for port, token, channel in self._told.due():
            self.outputs[port].send(token, channel)

    def _renege(self) -> None:
        """Let those leave whose patience is over."""
        if self.patience is not None:
            for each in [each for each in self._waiting if each.patience is not None and each.patience.due]:
                self._waiting.remove(each)
                self._tell_of("reneged", each)

    def _waiter(self, token: Any, channel: int, size: float) -> Waiter:
        number, self._came = self._came, self._came + 1
        place = float(-number if self.discipline == LIFO else number)
        if self.discipline == RANDOM:
            place = self.random.random()
        order = number_of_token(self.order, "an order", token, time=self.now, channel=channel)
        return Waiter(token, channel, order, place, size, number)

    def _join(self, newcomers: list[Waiter], serve: Callable[[], None]) -> None:
        """Let newcomers wait; those that cannot be served at once may turn away, or find no room."""
        for each in newcomers:
            self._waiting.add(each)
        serve()
        new = [each for each in sorted(newcomers, key=lambda each: each.key) if each in self._waiting]
        old = len(self._waiting) - len(new)
        sizes = [] if self.room is None or not new else [each.size for each in self._waiting if each not in new]
        stay = 0
        for each in new:
            if self._turns_away(each, old + stay):
                self._waiting.remove(each)
                self._tell_of("balked", each)
                continue
            sizes.append(each.size)
            if self.room is not None and math.fsum(sizes) > self.room:
                sizes.pop()
                self._waiting.remove(each)
                self._tell_of("rejected", each)
                continue
            stay += 1
            if self.patience is not None:
                each.patience = self.wake_in(self.patience.draw_time(self.random_stream("patience"), "a patience"))
        if stay < len(new):
            serve()  # who stood behind one that has left

    def _turns_away(self, waiter: Waiter, waiting: int) -> bool:
        if self.balking is None:
            return False
        known = {"time": self.now, "channel": waiter.channel, "waiting": waiting}
        share = of_token(self.balking, waiter.token, **known)
        if not isinstance(share, (bool, int, float)) or not 0 <= share <= 1:
            raise EpicycleError(f"{self.balking} gives {share!r}, but balking is a condition, or a probability")
        return share >= 1 or (share > 0 and self.random_stream("balking").random() < share)


def check_channels(actor: Actor, asks: str, answers: str) -> None:
    """Raise ``PortError`` unless each channel of an input has one of the output for its answers."""
    wanted, found = actor.inputs[asks].width, actor.outputs[answers].width
    if wanted > 1 and found not in (0, 1, wanted):
        raise PortError(
            f"{actor.inputs[asks].path} has {wanted} channels and {actor.outputs[answers].path} has {found}; they must "
            "have equally many, for what is asked for on a channel is sent on it"
        )
