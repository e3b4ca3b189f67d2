"""The common part of a pool and a waiting line: who waits, in which order, and why some leave before their turn."""

from __future__ import annotations

import math
from bisect import bisect_left, insort
from collections.abc import Mapping
from operator import attrgetter
from typing import Any, ClassVar, Final

from ..core import Actor, EpicycleError, OutputPort, Parameter, ParameterError, PortError, TimedQueue, Wake
from ..core.units import quantity
from ..distributions import Distribution
from ..expression import Formula, TokenFormula, TokenFormulaParameter

FIFO: Final = "fifo"
LIFO: Final = "lifo"
RANDOM: Final = "random"
_KEY: Final = attrgetter("key")


class PatienceParameter(Parameter[Distribution | TokenFormula | None]):
    """``2 min``, an expression over a token, or ``{type: Exponential, mean: 2 min}``."""

    def __init__(self, *, doc: str) -> None:
        super().__init__(float, None, unit="s", doc=doc)  # type: ignore[arg-type]
        self._time = Parameter(float, unit="s", min=0)
        self._law = Parameter(Distribution, unit="s")
        self._formula = TokenFormulaParameter(known=("time", "channel"))
        self.forms = (self._time, self._formula, self._law)

    def describe_type(self) -> str:
        return "time, expression, or distribution"

    def convert(self, value: object) -> Distribution | TokenFormula | None:
        if value is None:
            return None
        if isinstance(value, (Mapping, Distribution)):
            return self._law.convert(value)
        if isinstance(value, (str, Formula, TokenFormula)):
            try:
                return self._formula.convert(value)
            except ParameterError:
                if quantity(str(value)) is None:
                    raise
        return self._formula.convert(self._time.convert(value))


class Waiter:
    """A token that waits, or that has got what it waited for.

    ``order``, then ``place`` among those of the same order, say who goes first; ``number`` is unique.
    """

    __slots__ = ("amounts", "channel", "key", "mark", "number", "order", "patience", "size", "token")

    def __init__(
        self,
        token: Any,
        channel: int,
        order: float,
        place: float,
        size: float,
        number: int,
        amounts: tuple[int, ...] = (),
    ) -> None:
        self.token = token
        self.channel = channel
        self.order = order
        self.size = size
        self.number = number
        self.key = order, place, number  # the lower one goes first
        self.amounts = amounts  # of requested units, by kind
        self.patience: Wake | None = None
        self.mark: tuple[Any] | None = None  # what it has in common with its release, once somebody has asked


class Waiters(list[Waiter]):
    """The waiting tokens, in the order in which they leave."""

    def add(self, waiter: Waiter) -> None:
        """Insert one at its place."""
        insort(self, waiter, key=_KEY)

    def remove(self, waiter: Waiter) -> None:
        """Remove one."""
        self.take(bisect_left(self, waiter.key, key=_KEY))

    def take(self, place: int = 0) -> Waiter:
        """Remove and return the one at a place: the next one to go, if none is given."""
        waiter = self.pop(place)
        if waiter.patience is not None:
            waiter.patience.cancel()
            waiter.patience = None
        return waiter

    def __contains__(self, waiter: object) -> bool:
        assert isinstance(waiter, Waiter)
        place = bisect_left(self, waiter.key, key=_KEY)
        return place < len(self) and self[place] is waiter


class WaitingActor(Actor):
    """Base of actors in which tokens wait for their turn.

    All tokens of a tag are handled together, and outputs are sent at the next microstep, so the actor may be part of a
    loop.  A subclass has the outputs ``rejected``, ``balked``, ``reneged`` and ``waiting``.
    """

    entrance: ClassVar[str]  # the input where tokens come in

    discipline = Parameter(
        str, FIFO, choices=(FIFO, LIFO, RANDOM), doc="order among equals: first come, last come, or random"
    )
    order = TokenFormulaParameter(
        "0",
        known=("time", "channel"),
        doc="the lowest value goes first: an expression over the token's fields, token, time, channel",
    )
    room = Parameter(float, None, min=0, doc="how much may wait; unlimited if left out")
    balking: Parameter[Any] = TokenFormulaParameter(
        None,
        known=("time", "channel", "waiting"),
        doc="when a token that would have to wait leaves: a condition or probability over its fields, and waiting (a "
        "number)",
    )
    patience = PatienceParameter(
        doc="how long a token waits until it reneges: a time, a distribution, or an expression (s) over the token's "
        "fields, token, time, channel; for ever if left out or inf"
    )

    def check(self) -> None:
        if isinstance(self.patience, Distribution) and self.patience.token_type not in (int, float):
            raise ParameterError(f"patience: {type(self.patience).__name__} gives values other than numbers")

    def initialize(self) -> None:
        self._waiting = Waiters()
        self._told = TimedQueue()  # lists of what firings have told, for the next microstep
        self._telling: list[tuple[OutputPort[Any], Any, int | None]] | None = None  # that of the present one
        self._counts = dict.fromkeys(self.outputs, 0)  # the values sent last
        self._entrance = self.inputs[self.entrance]
        width = self._entrance.width
        self._answers = {name for name, output in self.outputs.items() if output.multi and output.width == width}
        self._came = 0

    def fire(self) -> None:
        self._telling = None
        while self._told.is_due():
            for output, token, channel in self._told.pop():
                output.send(token, channel)
        has_lost = self.patience is not None and self._renege()
        if self._make_room() or self._entrance.present or has_lost:
            self._join()
            self._tell_counts()

    # To be defined by a subclass.

    def _make_room(self) -> bool:
        """Take in what lets tokens go; returns whether there is anything."""
        raise NotImplementedError

    def _newcomer(self, token: Any, channel: int, now: float) -> Waiter:
        """A token that comes in, with ``_waiter``."""
        raise NotImplementedError

    def _serve(self) -> None:
        """Let the tokens go whose turn has come."""
        raise NotImplementedError

    def _tell_counts(self) -> None:
        """Tell the counts that have changed, with ``_tell_count``."""
        raise NotImplementedError

    # For subclasses

    def _tell(self, port: str, token: Any, channel: int | None = None) -> None:
        """Send at the next microstep."""
        if self._telling is None:
            self._telling = []
            self._told.push(self.context.wake(self, self.context.time), self._telling)
        self._telling.append((self.outputs[port], token, channel))

    def _tell_of(self, port: str, waiter: Waiter) -> None:
        self._tell(port, waiter.token, waiter.channel if port in self._answers else None)

    def _tell_count(self, port: str, count: int) -> None:
        if self._counts[port] != count:
            self._counts[port] = count
            self._tell(port, count)

    def _waiter(self, token: Any, channel: int, now: float, size: float = 1.0, amounts: tuple[int, ...] = ()) -> Waiter:
        number, self._came = self._came, self._came + 1
        place = float(-number if self.discipline == LIFO else number)
        if self.discipline == RANDOM:
            place = self.random.random()
        order = self.order.number("an order", token, now, channel)
        return Waiter(token, channel, order, place, size, number, amounts)

    # The course of a firing

    def _renege(self) -> bool:
        """Remove those whose patience has run out; returns whether there are any."""
        over = [each for each in self._waiting if each.patience is not None and each.patience.due]
        for each in over:
            self._waiting.remove(each)
            self._tell_of("reneged", each)
        return bool(over)

    def _join(self) -> None:
        """Let new tokens wait; those that cannot be served at once may leave, or find no room."""
        newcomers: list[Waiter] = []
        if self._entrance.present:
            now = self.now
            for channel, token in self._entrance.arrivals():
                newcomers.append(self._newcomer(token, channel, now))
                self._waiting.add(newcomers[-1])
        self._serve()
        if not newcomers or not self._waiting or (self.room is None and self.balking is None and self.patience is None):
            return
        new = [each for each in sorted(newcomers, key=_KEY) if each in self._waiting]
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
            patience = self._patience_of(each)
            if patience < math.inf:
                each.patience = self.wake_in(patience)
        if stay < len(new):
            self._serve()  # those behind one that has left

    def _patience_of(self, waiter: Waiter) -> float:
        if self.patience is None:
            return math.inf
        if isinstance(self.patience, Distribution):
            return self.patience.draw_time(self.random_stream("patience"), "a patience")
        time = self.patience(waiter.token, self.now, waiter.channel)
        if isinstance(time, bool) or not isinstance(time, (int, float)) or not time >= 0:
            raise EpicycleError(f"{self.patience} gives {time!r}, but a patience must be a time >= 0 s, or inf")
        return time

    def _turns_away(self, waiter: Waiter, waiting: int) -> bool:
        if self.balking is None:
            return False
        share = self.balking(waiter.token, self.now, waiter.channel, waiting)
        if not isinstance(share, (bool, int, float)) or not 0 <= share <= 1:
            raise EpicycleError(
                f"{self.balking} gives {share!r}, but balking must be true or false, or a probability from 0 to 1"
            )
        return share >= 1 or (share > 0 and self.random_stream("balking").random() < share)


def check_channels(actor: Actor, asks: str, answers: str) -> None:
    """Raise ``PortError`` unless each channel of an input has a channel of the output for its answers."""
    wanted, found = actor.inputs[asks].width, actor.outputs[answers].width
    if wanted > 1 and found not in (0, 1, wanted):
        raise PortError(
            f"{actor.inputs[asks].path} has {wanted} channels and {actor.outputs[answers].path} has {found}; give "
            "both the same number of channels, because requests on a channel are answered on it"
        )
