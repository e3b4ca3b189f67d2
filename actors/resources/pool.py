"""Pool: units of a resource that actors acquire and release."""

from __future__ import annotations

from typing import Any, ClassVar

from ..core import EpicycleError, InputPort, OutputPort, Parameter, PortError, PortParameter, brief, counted
from ..expression import FormulaParameter, number_of_token, of_token
from .waiting import Waiter, WaitingActor, check_channels


class Pool(WaitingActor):
    """Units of a resource: a token at ``acquire`` requests some and comes back from ``granted`` when it has them; a
    token at ``release`` returns them.  Each connection is a requester, which requests, is answered and releases on the
    same channel.

        connections:
          - robot[*].empty -> chargers.acquire
          - chargers.granted -> robot[*].plug
          - robot[*].full -> chargers.release

    Or tokens pass through: ``jobs.output -> crew.acquire``, ``crew.granted -> work.input`` (a ``Server`` with
    ``servers: null``), ``work.output -> crew.release``.  A release returns what the oldest request of its channel
    holds, or the one with an equal ``key``; with a single connection at ``release``, of any channel.  Releasing a
    request that holds nothing yet withdraws it.

    Requests wait in the order of ``order`` (lowest first), then of ``discipline``; none overtakes the first, even if
    its ``amount`` is large.  With ``preemptive``, a request takes units from requests with a higher ``order``, the
    highest and latest first: their tokens leave from ``preempted``, wait again at their old place, and are granted
    again.  The same happens when ``capacity`` falls below what is held; without ``preemptive``, units are kept until
    they are released.  For shifts, connect a ``Clock`` to ``capacity``: ``{period: 24 h, offsets: [8 h, 16 h], values:
    [3, 1]}``.

    At one tag, requests renege first; then come the capacity, releases, and requests.  Outputs are sent at the next
    microstep, so the actor may be part of a loop.  Sources: SimPy's ``PreemptiveResource``; Pegden and others,
    Introduction to Simulation Using SIMAN (seize and release); Ptolemy: ``ResourcePool``.
    """

    entrance: ClassVar[str] = "acquire"

    acquire = InputPort(multi=True, doc="requests units")
    release = InputPort(multi=True, doc="returns units, or withdraws a request")
    granted = OutputPort(multi=True, depends_on=(), doc="each request when it gets its units")
    preempted = OutputPort(multi=True, depends_on=(), doc="each request that lost its units and waits again")
    rejected = OutputPort(multi=True, depends_on=(), doc="requests that found no room")
    balked = OutputPort(multi=True, depends_on=(), doc="requests that did not join the line")
    reneged = OutputPort(multi=True, depends_on=(), doc="requests that lost their patience")
    in_use = OutputPort(int, depends_on=(), doc="number of units held, whenever it changes")
    waiting = OutputPort(int, depends_on=(), doc="number of waiting requests, whenever it changes")

    capacity = PortParameter(int, 1, min=0, doc="number of units")
    amount = FormulaParameter(
        "1", doc="number of units requested: an expression over the token's fields, token, time, channel"
    )
    preemptive = Parameter(bool, False, doc="whether requests with a lower 'order' take units from others")
    key: Parameter[Any] = FormulaParameter(
        None, doc="a release and its request have this value in common: an expression over their fields, and token"
    )

    def initialize(self) -> None:
        super().initialize()
        for name in ("granted", "preempted", "rejected", "balked", "reneged"):
            check_channels(self, "acquire", name)
        if self.release.width not in (1, self.acquire.width):
            raise PortError(
                f"{self.acquire.path} has {counted(self.acquire.width, 'channel')} and {self.release.path} has "
                f"{self.release.width}; give it 1 channel, or as many, because units are released on the channel of "
                "their request"
            )
        self._held: list[Waiter] = []  # in the order in which they were granted
        self._in_use = 0
        self._has_begun_anew = False

    def restart(self) -> None:
        super().restart()
        self._has_begun_anew = True  # and may return what it does not know

    def fire(self) -> None:
        self._send()
        self._renege()
        for channel, tokens in enumerate(self.release.by_channel()):
            for token in tokens:
                self._return(token, channel)
        newcomers = [
            self._request(token, channel)
            for channel, tokens in enumerate(self.acquire.by_channel())
            for token in tokens
        ]
        self._join(newcomers, self._serve)
        self._tell_count("in_use", self._in_use)
        self._tell_count("waiting", len(self._waiting))

    def _request(self, token: Any, channel: int) -> Waiter:
        amount = number_of_token(self.amount, "an amount", token, time=self.now, channel=channel)
        if amount != int(amount) or amount < 1:
            raise EpicycleError(f"{self.amount} gives {amount:g}, but an amount must be a whole number >= 1")
        if amount > self.capacity and not self.inputs["capacity"].width:
            have = counted(self.capacity, "unit")
            raise EpicycleError(f"{brief(token)} requests {amount:g} of {have} and would wait for ever")
        waiter = self._waiter(token, channel, 1.0)
        waiter.amount = int(amount)
        return waiter

    def _return(self, token: Any, channel: int) -> None:
        wanted = None if self.key is None else of_token(self.key, token)

        def is_meant(request: Waiter) -> bool:
            if self.release.width == self.acquire.width and request.channel != channel:
                return False
            return self.key is None or bool(of_token(self.key, request.token) == wanted)

        held = next(filter(is_meant, self._held), None)
        if held is not None:
            self._held.remove(held)
            self._in_use -= held.amount
            return
        waiting = min(filter(is_meant, self._waiting), key=lambda each: each.number, default=None)
        if waiting is not None:
            self._waiting.remove(waiting)
        elif not self._has_begun_anew:
            what = "" if self.key is None else f" with the key {wanted!r}"
            raise EpicycleError(
                f"{self.release.path} got {brief(token)} on channel {channel}, which has no request{what}"
            )

    def _serve(self) -> None:
        """Grant requests while there are units."""
        if self.preemptive:
            self._take_back(self._last_of(self._held, self._in_use - self.capacity)[0])
        while len(self._waiting):
            first = self._waiting.first
            lacking = first.amount - (self.capacity - self._in_use)
            if lacking > 0:
                later = [each for each in self._held if each.order > first.order] if self.preemptive else []
                losers, missing = self._last_of(later, lacking)
                if missing > 0:
                    return
                self._take_back(losers)
            self._waiting.remove(first)
            self._held.append(first)
            self._in_use += first.amount
            self._tell_of("granted", first)

    def _last_of(self, holders: list[Waiter], amount: int) -> tuple[list[Waiter], int]:
        """The last requests that together hold a number of units, and how many are still missing."""
        found: list[Waiter] = []
        for each in sorted(holders, key=lambda each: each.key, reverse=True):
            if amount <= 0:
                break
            found.append(each)
            amount -= each.amount
        return found, amount

    def _take_back(self, losers: list[Waiter]) -> None:
        for each in losers:
            self._held.remove(each)
            self._in_use -= each.amount
            self._waiting.add(each)
            self._tell_of("preempted", each)
