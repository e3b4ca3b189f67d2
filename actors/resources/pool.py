"""Pool and Pools: units of one or several resources that actors acquire and release."""

from __future__ import annotations

from operator import add, and_, sub
from typing import Any, ClassVar

from ..core import (
    EpicycleError,
    InputPort,
    MappingParameter,
    OutputPort,
    Parameter,
    ParameterError,
    PortError,
    PortParameter,
    brief,
    counted,
    did_you_mean,
)
from ..expression import TokenFormula, TokenFormulaParameter
from .waiting import Waiter, WaitingActor, check_channels


class _Pools(WaitingActor):
    """The common part: requests for units of some kinds, in one waiting line."""

    entrance: ClassVar[str] = "acquire"

    acquire = InputPort(multi=True, doc="requests units")
    release = InputPort(multi=True, doc="returns units, or withdraws a request")
    granted = OutputPort(multi=True, depends_on=(), doc="each request when it gets its units")
    preempted = OutputPort(multi=True, depends_on=(), doc="each request that lost its units and waits again")
    rejected = OutputPort(multi=True, depends_on=(), doc="requests that found no room")
    balked = OutputPort(multi=True, depends_on=(), doc="requests that did not join the line")
    reneged = OutputPort(multi=True, depends_on=(), doc="requests that lost their patience")
    waiting = OutputPort(int, depends_on=(), doc="number of waiting requests, whenever it changes")

    preemptive = Parameter(bool, False, doc="whether requests with a lower 'order' take units from others")
    key: Parameter[Any] = TokenFormulaParameter(
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
        self._is_by_channel = self.release.width == self.acquire.width
        self._held: list[Waiter] = []  # in the order in which they were granted
        self._capacities = self._units()  # of each kind, at the latest firing
        self._in_use = [0] * len(self._capacities)
        self._has_begun_anew = False

    def restart(self) -> None:
        super().restart()
        self._has_begun_anew = True  # and may return what it does not know

    # To be defined by a subclass.

    def _units(self) -> tuple[int, ...]:
        """The present number of units of each kind."""
        raise NotImplementedError

    def _amounts(self, token: Any, channel: int, now: float) -> tuple[int, ...]:
        """How many of each kind a token requests."""
        raise NotImplementedError

    # Requests

    def _make_room(self) -> bool:
        units = self._units()
        if units == self._capacities and not self.release.present:
            return False
        self._capacities = units
        for channel, token in self.release.arrivals():
            self._return(token, channel)
        if self.preemptive:
            excess = [used - there for used, there in zip(self._in_use, units, strict=True)]
            self._take_back(self._last_of(self._held, excess)[0])
        return True

    def _newcomer(self, token: Any, channel: int, now: float) -> Waiter:
        return self._waiter(token, channel, now, amounts=self._amounts(token, channel, now))

    def _amount(self, formula: TokenFormula, token: Any, channel: int, now: float, least: int) -> int:
        amount = formula.number("an amount", token, now, channel)
        if amount != int(amount) or amount < least:
            raise EpicycleError(f"{formula} gives {amount:g}, but an amount must be a whole number >= {least}")
        return int(amount)

    def _return(self, token: Any, channel: int) -> None:
        wanted = None if self.key is None else self.key.call(token)
        for held in self._held:
            if self._is_meant(held, channel, wanted):
                self._give_back(held)
                return
        waiting = [each for each in self._waiting if self._is_meant(each, channel, wanted)]
        if waiting:
            self._waiting.remove(min(waiting, key=lambda each: each.number))
        elif not self._has_begun_anew:
            what = "" if self.key is None else f" with the key {wanted!r}"
            raise EpicycleError(
                f"{self.release.path} got {brief(token)} on channel {channel}, which has no request{what}"
            )

    def _is_meant(self, request: Waiter, channel: int, wanted: Any) -> bool:
        """Whether a release on a channel, with a value of the key, is of a request."""
        if self._is_by_channel and request.channel != channel:
            return False
        if self.key is None:
            return True
        if request.mark is None:
            request.mark = (self.key.call(request.token),)
        return bool(request.mark[0] == wanted)

    def _grant(self, place: int) -> bool:
        """Grant the request at a place of the line if there are units for it; whether it was."""
        request = self._waiting[place]
        if not (self._are_free(request.amounts) or (self.preemptive and self._has_preempted_for(request))):
            return False
        self._held.append(self._waiting.take(place))
        self._in_use = list(map(add, self._in_use, request.amounts))
        self._tell_of("granted", request)
        return True

    def _are_free(self, amounts: tuple[int, ...]) -> bool:
        for amount, used, there in zip(amounts, self._in_use, self._capacities, strict=True):
            if amount and amount + used > there:
                return False
        return True

    def _has_preempted_for(self, request: Waiter) -> bool:
        """Let others give up their units for a request, and wait behind it, if that is enough; whether it was."""
        lacking = [
            amount + used - there if amount else 0
            for amount, used, there in zip(request.amounts, self._in_use, self._capacities, strict=True)
        ]
        later = [each for each in self._held if each.order > request.order]
        losers, is_enough = self._last_of(later, lacking)
        if is_enough:
            self._take_back(losers)
        return is_enough

    def _last_of(self, holders: list[Waiter], lacking: list[int]) -> tuple[list[Waiter], bool]:
        """The last requests that together hold what is lacking of each kind, and whether they do."""
        found: list[Waiter] = []
        if max(lacking) > 0:
            for each in sorted(holders, key=lambda each: each.key, reverse=True):
                if any(amount and lack > 0 for amount, lack in zip(each.amounts, lacking, strict=True)):
                    found.append(each)
                    lacking = [lack - amount for lack, amount in zip(lacking, each.amounts, strict=True)]
        return found, max(lacking) <= 0

    def _take_back(self, losers: list[Waiter]) -> None:
        for each in losers:
            self._give_back(each)
            self._waiting.add(each)
            self._tell_of("preempted", each)

    def _give_back(self, request: Waiter) -> None:
        self._held.remove(request)
        self._in_use = list(map(sub, self._in_use, request.amounts))


class Pool(_Pools):
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

    in_use = OutputPort(int, depends_on=(), doc="number of units held, whenever it changes")

    capacity = PortParameter(int, 1, min=0, doc="number of units")
    amount = TokenFormulaParameter(
        "1",
        known=("time", "channel"),
        doc="number of units requested: an expression over the token's fields, token, time, channel",
    )

    def _serve(self) -> None:
        while self._waiting and self._grant(0):
            pass

    def _units(self) -> tuple[int, ...]:
        return (self.capacity,)

    def _amounts(self, token: Any, channel: int, now: float) -> tuple[int, ...]:
        amount = self._amount(self.amount, token, channel, now, least=1)
        if amount > self._capacities[0] and not self.inputs["capacity"].width:
            have = counted(self.capacity, "unit")
            raise EpicycleError(f"{brief(token)} requests {amount:g} of {have} and would wait for ever")
        return (amount,)

    def _tell_counts(self) -> None:
        self._tell_count("in_use", self._in_use[0])
        self._tell_count("waiting", len(self._waiting))


class Pools(_Pools):
    """Several pools from which a token acquires units at once or not at all, and to which it releases them at once.

        actors:
          ward:
            type: Pools
            capacity: {doctor: 3, room: 4}
            amount: {doctor: 2 if urgent else 1, room: 1}
            key: number  # a release gives back what the same patient has
            patience: 2 h
        connections:
          - patient.output -> ward.acquire
          - ward.granted -> treatment.input
          - treatment.output -> ward.release

    A request holds nothing while it waits, so requests cannot block each other for ever.  It stands in the queue of
    every pool from which it needs units, and gets all of them when they are free and none is ahead of it in any of
    these queues; one that needs nothing of what those ahead wait for overtakes them.  A request that reneges or is
    withdrawn leaves all queues, and one that is preempted loses all its units.

    Each pool has two ports of its own: the input ``doctor_capacity`` takes its number of units, for shifts, and the
    output ``doctor_in_use`` tells how many are held.  All else is as in a ``Pool``.  Sources: Kelly, Loss Networks;
    salabim's ``request`` of several resources.
    """

    capacity: Parameter[dict[str, int]] = MappingParameter(Parameter(int, min=0), doc="number of units of each pool")
    amount: Parameter[dict[str, TokenFormula] | None] = MappingParameter(
        TokenFormulaParameter(known=("time", "channel")),
        None,
        doc="number of units requested from pools, 0 from those left out: expressions over the token's fields, token, "
        "time, channel; a unit from each pool if left out",
    )

    def own_ports(self) -> dict[str, InputPort[Any] | OutputPort[Any]]:
        ports: dict[str, InputPort[Any] | OutputPort[Any]] = {}
        for name in self.capacity:
            ports[f"{name}_capacity"] = InputPort(int, required=False, doc="number of units of the pool from then on")
            ports[f"{name}_in_use"] = OutputPort(int, depends_on=(), doc="number of units held, whenever it changes")
        return ports

    def check(self) -> None:
        super().check()
        if not self.capacity:
            raise ParameterError(
                "capacity: there is no pool; name at least one, as in {doctor: 3, room: 4}", ("capacity",)
            )
        for name in self.amount or ():
            if name not in self.capacity:
                near = did_you_mean(name, self.capacity) or ";"
                raise ParameterError(
                    f"amount: there is no pool {name!r}{near} valid names: {', '.join(self.capacity)}",
                    ("amount", name),
                    of_key=True,
                )

    def initialize(self) -> None:
        self._present = dict(self.capacity)
        super().initialize()

    def fire(self) -> None:
        for name in self.capacity:
            port = self.inputs[f"{name}_capacity"]
            for units in port.tokens:
                if units < 0:
                    raise EpicycleError(f"{port.path} got {units}, but a number of units must be >= 0")
                self._present[name] = units
        super().fire()

    def _serve(self) -> None:
        """Grant requests that have none ahead of them at any of their pools while there are units."""
        claimed = [False] * len(self._capacities)  # pools for which a request waits
        place = 0
        while place < len(self._waiting) and not all(claimed):
            amounts = self._waiting[place].amounts
            if any(map(and_, claimed, map(bool, amounts))) or not self._grant(place):
                claimed = [each or amount > 0 for each, amount in zip(claimed, amounts, strict=True)]
                place += 1

    def _units(self) -> tuple[int, ...]:
        return tuple(self._present.values())

    def _amounts(self, token: Any, channel: int, now: float) -> tuple[int, ...]:
        amounts = dict.fromkeys(self.capacity, 1 if self.amount is None else 0)
        for name, formula in (self.amount or {}).items():
            amounts[name] = self._amount(formula, token, channel, now, least=0)
        if not any(amounts.values()):
            raise EpicycleError(f"{brief(token)} requests nothing from any of {', '.join(amounts)}")
        for name, amount in amounts.items():
            if amount > self._present[name] and not self.inputs[f"{name}_capacity"].width:
                have = counted(self._present[name], "unit")
                raise EpicycleError(f"{brief(token)} requests {amount:g} of {have} of {name} and would wait for ever")
        return tuple(amounts.values())

    def _tell_counts(self) -> None:
        for name, used in zip(self.capacity, self._in_use, strict=True):
            self._tell_count(f"{name}_in_use", used)
        self._tell_count("waiting", len(self._waiting))
