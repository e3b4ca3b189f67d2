"""The discrete-event director: which actor fires when.

Order of events
---------------
Events are ordered by tag, that is by time and then microstep.  Within a tag, tokens whose delay is over are put into
their ports first, in the order in which they were sent; then actors fire by rank (``firing_order``: depth in the graph
of connections without delay, then priority, ties in the order of declaration).  A firing sees all tokens that its actor
gets at this tag, because all that can still send to it within the tag have a lower rank.  An actor therefore fires
once per tag; the exception is one with an output that does not depend on an input at once (``depends_on``), which
may have to send before that input is there: its tokens are taken in a firing of their own, at the rank of the input.

A token sent over a connection without delay arrives at the same tag; with delay d > 0 at (time + d, 1); with delay 0
at the next microstep.  A wake-up for the present time comes at the next microstep, one for the future at
microstep 1.  The first tag of a run is (start, 1).

SimPy owns time, and the events of processes and resources.  The director has an agenda of its own beside it: of the
two, who is first goes on.  At one instant all that SimPy has to do comes first, and what processes send then is
received at the first microstep that the director has not handled yet.

Departures from Ptolemy II: a firing sees all tokens of its tag at once, where Ptolemy fires again for each further
token; and tokens that an actor does not read do not stay in the port.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from heapq import heappop, heappush
from typing import Any, NoReturn

from epicycle.actors import Actor, EpicycleError, InputPort, Process, Tag, Wake, readable
from epicycle.aspects import Job

from ..text import NORMAL, RAISE_IT, Limits, Position, describe, told_raised
from .agenda import Environment, Instant, Turn
from .pace import Pace

MAX_MICROSTEPS = 100_000
MAX_STEPS = 1_000_000  # of SimPy at one instant
REPORTED = 256  # tokens that come together at one port: so many at a time are counted
SHOWN = 3  # ports in the message of a ``CrowdError``
_START = 0


class ActorError(EpicycleError):
    """An actor raised an exception: names it and the tag; the exception itself is the cause.

    ``where`` is where the actor is declared, ``raised`` the line of a user's program from which the exception comes.
    """

    def __init__(
        self, path: str, tag: Tag, doing: str, reason: str, where: str = "", raised: Position | None = None
    ) -> None:
        super().__init__(path, tag, doing, reason, where, raised)
        self.path = path
        self.tag = tag
        self.doing = doing
        self.reason = reason
        self.where = where
        self.raised = raised

    def __str__(self) -> str:
        lines = [readable(f"{self.path} failed in {self.doing} at {self.tag}: {self.reason}")]
        lines += told_raised(self.raised) if self.raised is not None else []
        lines += [f"   declared at {self.where}"] if self.where else []
        return "\n".join(lines)


class LoopError(EpicycleError):
    """Time stands still: too many microsteps at one instant, or too many events of SimPy's."""

    def __init__(self, time: int, actors: tuple[str, ...]) -> None:
        super().__init__(time, actors)
        self.time = time
        self.actors = actors

    def __str__(self) -> str:
        head = f"time stands still at {self.time / 1e9:g} s: more than "
        if not self.actors:
            return head + f"{MAX_STEPS:,} SimPy events; a process waits again and again for no time at all"
        names = ", ".join(self.actors)
        return head + (
            f"{MAX_MICROSTEPS:,} microsteps; the last actors that fired: {names}; give their loop a delay above zero"
        )


class CrowdError(LoopError):
    """More at one tag, or still to come, than was meant to be; ``where`` are the ports at which most of it is."""

    def __init__(self, tag: Tag, most: int, what: str, where: tuple[str, ...]) -> None:
        super().__init__(tag.time, where)
        self.args = (tag, most, what, where)
        self.tag, self.most, self.what, self.where = self.args

    def of(self, who: str) -> CrowdError:
        """The same, with the name of who adds to it."""
        return CrowdError(self.tag, self.most, self.what, (who,))

    def __str__(self) -> str:
        where = f", most of them at {', '.join(self.where)}" if self.where else ""
        return readable(f"too much at {self.tag}: more than {self.most:,} {self.what}{where}; {RAISE_IT}")


class Crowd:
    """Counts what one tag holds, where there is much of it: those who add to it report many at a time."""

    def __init__(self, most: int) -> None:
        self.most = most
        self._tag: Tag | None = None
        self._total = 0
        self._by_port: dict[str, int] = {}

    def add(self, tag: Tag, port: str, number: int) -> None:
        """So many more at a port; raises ``CrowdError``."""
        if tag != self._tag:
            self._tag, self._total, self._by_port = tag, 0, {}
        self._total += number
        self._by_port[port] = self._by_port.get(port, 0) + number
        if self._total > self.most:
            ports = sorted(self._by_port, key=self._by_port.__getitem__, reverse=True)
            raise CrowdError(tag, self.most, "tokens and acts of aspects", tuple(ports[:SHOWN]))


class Director:
    """Fires the actors of one run."""

    def __init__(self, order: dict[str, int], seed: int, limits: Limits = NORMAL) -> None:
        self.environment = Environment(initial_time=_START)
        self.seed = seed
        self.crowd = Crowd(limits.tokens)
        self._on_their_way = 0  # tokens, to times and microsteps to come
        self._most_times = limits.times
        self.firings = 0
        self.steps = 0  # tags, and events of SimPy's
        # The tag that is being handled, also while its time has another; None between, while SimPy does things.
        self.present: Tag | None = None
        self.last = Tag(_START, 0)  # the latest tag that was handled, or is being handled
        self.ranks = order  # of actors and of their inputs
        self._turns: dict[int, Turn] = {}  # by rank
        # What is to be done: at the present tag the ranks of turns (a heap), then the next microstep, then later times.
        # One entry per actor and tag, whatever the number of its tokens.
        self._ready: list[int] = []
        self._next: Instant | None = None
        self._instants: dict[int, Instant] = {}
        self._times: list[int] = []  # theirs (a heap)
        self._rank = -1  # the rank of what is handled now
        self._stop_after: Tag | None = None
        self._reason = "no events left"
        self._recent: list[str] | None = None  # who fires, when it looks as if time stood still

    @property
    def tag(self) -> Tag:
        """The present tag: outside of firings (a process that SimPy resumed), the first not handled yet."""
        if self.present is not None:
            return self.present
        # SimPy's time need not be whole; what comes between two nanoseconds belongs to the later one.
        now = math.ceil(self.environment.now)
        return Tag(now, 1) if now > self.last.time else Tag(self.last.time, self.last.microstep + 1)

    # -- what actors and aspects ask for --------------------------------------------------------------------------

    def wake(self, actor: Actor, time: int) -> Wake:
        """Fire ``actor`` at ``time``; the present or past is the next microstep."""
        rank, present = self.ranks[actor.path], self.present
        if present is None or time <= present.time:
            return self.call(actor, self._tag_at(time), rank)
        instant = self._instants.get(time) or self._await(Tag(time, 1))
        wake = Wake(instant.tag)
        instant.wakes.append((self.turn(actor, rank), wake))
        return wake

    def call(self, actor: Actor, tag: Tag, rank: int) -> Wake:
        """Fire ``actor`` at a tag and rank that are still to come."""
        turn = self.turn(actor, rank)
        if tag == self.tag:
            wake = Wake(tag)
            turn.wakes.append(wake)
            self._want(turn)
        else:
            instant = self._to_come(tag)
            wake = Wake(instant.tag)  # which is equal: one tag for all that is to be done
            instant.wakes.append((turn, wake))
        return wake

    def turn(self, actor: Actor, rank: int) -> Turn:
        """The turn of a rank, which ``actor`` has: an actor of the model, or who stands in for it."""
        turn = self._turns.get(rank)
        if turn is None:
            turn = self._turns[rank] = Turn(actor, rank, self.ranks)
        return turn

    def entry(self, port: InputPort[Any], channel: int, stand_in: Actor | None = None) -> Callable[[Any], None]:
        """What puts tokens into a port at the present tag, and lets its actor fire, or who stands in for it."""
        turn = self.turn(stand_in or port.actor, self.ranks[port.path])
        rank, ready = turn.rank, self._ready
        put, put_channel = port.entry()
        arrived = port.arrived

        def enter(token: Any) -> None:
            put(token)
            put_channel(channel)
            if not turn.is_wanted:  # as in _want, without the call: this is done for every token that arrives
                turn.is_wanted = True
                heappush(ready, rank)
                if self.present is None:
                    self._await_present()
            elif not len(arrived) % REPORTED:
                self.crowd.add(self.tag, port.path, REPORTED)

        return enter

    def trigger(self, actor: Actor) -> None:
        """Fire ``actor`` at the present tag."""
        self._want(self.turn(actor, self.ranks[actor.path]))

    def later(self, delay: int, deliver: Callable[[Any], None], token: Any) -> None:
        """Call ``deliver(token)`` after ``delay`` ns; 0 is the next microstep."""
        now = self.tag
        tag = Tag(now.time + delay, 1) if delay > 0 else Tag(now.time, now.microstep + 1)
        deliveries = self._to_come(tag).deliveries
        deliveries.append(self.hold(deliver, token))
        self._on_their_way += 1
        if len(deliveries) > self.crowd.most:
            raise CrowdError(tag, self.crowd.most, "tokens that are on their way", self._who())
        if self._on_their_way > self._most_times:
            raise CrowdError(now, self._most_times, "tokens that are on their way, to all times", self._who())

    def hold(self, deliver: Callable[[Any], None], token: Any) -> Callable[[], None]:
        """``deliver(token)``, to be called later."""
        return partial(deliver, token)

    def stop(self, reason: str) -> None:
        """End the run when the present tag has been handled; the first who asks gives the reason."""
        if self._stop_after is None:
            self._stop_after = self.tag
            self._reason = reason

    def next_turn(self, rank: int) -> Tag:
        """The first tag at which a turn of this rank is still to come."""
        now = self.tag
        is_over = self.present is not None and self._rank >= rank
        return Tag(now.time, now.microstep + 1) if is_over else now

    def set_aside(self, job: Job) -> None:
        """A firing is put off: what it is for does not belong to the next one of its actor."""

    def put_back(self, job: Job) -> None:
        """A firing that was put off is the next one of its actor."""

    def _tag_at(self, time: int) -> Tag:
        """The tag of a wake-up for ``time``."""
        now = self.tag
        if time > now.time:
            return Tag(time, 1)
        return now if self.present is None else Tag(now.time, now.microstep + 1)

    # -- the agenda -----------------------------------------------------------------------------------------------

    def _who(self) -> tuple[str, ...]:
        """The actor that fires now."""
        turn = self._turns.get(self._rank)
        return () if turn is None else (turn.actor.path,)

    def _want(self, turn: Turn) -> None:
        """Let an actor have a turn at the present tag."""
        if not turn.is_wanted:
            turn.is_wanted = True
            heappush(self._ready, turn.rank)
            if self.present is None:
                self._await_present()

    def _to_come(self, tag: Tag) -> Instant:
        """What is to be done at a tag after the present one: the next microstep, or the first one of a later time."""
        if tag.time > self.tag.time:
            return self._instants.get(tag.time) or self._await(tag)
        if self._next is None:
            self._next = Instant(tag)
            if self.present is None:
                self._await_present()
        return self._next

    def _await_present(self) -> None:
        """Between tags: see to it that the present one is going to be handled."""
        tag = self.tag
        if tag.time not in self._instants:
            self._await(tag)

    def _await(self, tag: Tag) -> Instant:
        """Put a tag into the agenda."""
        if len(self._instants) > self._most_times:
            raise CrowdError(tag, self._most_times, "times at which something is still to come", self._who())
        heappush(self._times, tag.time)
        instant = self._instants[tag.time] = Instant(tag)
        return instant

    # -- time -----------------------------------------------------------------------------------------------------

    def _handle(self, instant: Instant) -> None:
        tag, turns, ready = instant.tag, self._turns, self._ready
        for turn, wake in instant.wakes:
            turn.wakes.append(wake)
            if not turn.is_wanted:
                turn.is_wanted = True
                heappush(ready, turn.rank)
        if instant.deliveries:
            self._rank = -1
            self._begin(tag)
            for deliver in instant.deliveries:
                deliver()
            self._on_their_way -= len(instant.deliveries)
        while ready:
            turn = turns[heappop(ready)]
            turn.is_wanted = False
            self._rank = turn.rank
            if turn.wakes and not self._use_wakes(turn):
                continue
            if self.present is not tag:
                self._begin(tag)
            self.fire(turn)
        if self._next is None:
            self.present = None

    def _begin(self, tag: Tag) -> None:
        """Something happens at a tag, for the first time."""
        self.present = self.last = tag
        if tag.microstep > MAX_MICROSTEPS - 10:
            if tag.microstep > MAX_MICROSTEPS:
                raise LoopError(tag.time, tuple(dict.fromkeys(self._recent or ())))
            self._recent = self._recent or []
        else:
            self._recent = None

    def _use_wakes(self, turn: Turn) -> bool:
        """Make the wake-ups of a turn due; false if the actor has nothing to fire for after all."""
        return turn.use_wakes()

    def fire(self, turn: Turn) -> None:
        """Let an actor fire, in its turn."""
        self.firings += 1
        if self._recent is not None:
            self._recent.append(turn.actor.path)
        for port in turn.later:
            port.hold()
        try:
            turn.actor.fire()
        except (ActorError, LoopError, KeyboardInterrupt):  # of an aspect on the way of a token, of the user
            raise
        except BaseException as error:  # whatever an actor raises, sys.exit() too, is its failure
            doing = "run()" if isinstance(turn.actor, Process) else "fire()"
            raise ActorError(turn.actor.path, self.last, doing, describe(error)) from error
        finally:
            for port in turn.ports:
                port.clear()
            for port in turn.later:
                port.release()

    def interrupt(self) -> None:
        """Raise ``KeyboardInterrupt`` in the place of the next firing, or of the next instant."""

        def raise_it(_: Any) -> NoReturn:
            raise KeyboardInterrupt

        vars(self)["fire"] = vars(self.environment)["comes_by"] = raise_it

    def run(
        self,
        stop: int | None,
        actors: list[Actor],
        progress: Callable[[float], None] | None = None,
        pace: Pace | None = None,
        most: int | None = None,
    ) -> str:
        """Handle events up to and including ``stop`` (ns), until none is left, or until a stop was asked for.

        Returns why it ended; nothing if that is because ``most`` steps are done, of which each is a tag or an event of
        SimPy's.
        """
        environment, times = self.environment, self._times
        last_step = math.inf if most is None else self.steps + most
        here = 0
        now: float = self.last.time
        if pace is not None:
            pace.wait_for(now)
        if progress is not None:
            progress(now / 1e9)
        while self.steps < last_step:
            after, instant = self._stop_after, self._next if self.present is not None else None
            if after is not None and self.last >= after:
                break
            goes_on, is_of_simpy = instant is not None, False
            if instant is not None:  # more of the present time
                upcoming: float = instant.tag.time
            else:
                upcoming = times[0] if times else math.inf
                if environment.comes_by(upcoming):
                    upcoming, is_of_simpy = environment.peek(), True
                if upcoming == math.inf or (after is not None and max(upcoming, self.last.time) > after.time):
                    break
            if stop is not None and upcoming > stop:
                if pace is not None:
                    pace.wait_for(stop)
                return "stop time"
            if pace is not None and upcoming > now:
                pace.wait_for(upcoming)
            try:
                if is_of_simpy:
                    environment.step()
                elif instant is not None:
                    self._next = None
                    self._handle(instant)
                else:
                    environment.move_on(times[0])
                    self._handle(self._instants.pop(heappop(times)))
            except BaseException as error:
                self.present = None
                if isinstance(error, (ActorError, LoopError, KeyboardInterrupt)):
                    raise
                found, cause = self._of_process(error, actors)
                raise found from cause
            here = here + (not goes_on) if upcoming == now else 0
            now = upcoming
            if here > MAX_STEPS:
                raise LoopError(self.tag.time, ())
            self.steps += 1
            if progress is not None and self.steps % 16 == 0:
                progress(now / 1e9)
        else:
            return ""
        return self._reason

    def _of_process(self, error: BaseException, actors: list[Actor]) -> tuple[ActorError, BaseException | None]:
        """The error of a process that SimPy resumed, and its cause: from there, no firing says whose it was."""
        for actor in actors:
            failure = actor.failure if isinstance(actor, Process) else None
            if isinstance(failure, ActorError):  # of an aspect or a metric, to which the process has sent
                return failure, failure.__cause__
            if failure is not None:
                return ActorError(actor.path, self.tag, "run()", describe(failure)), failure
        cause = error.__cause__ or error  # SimPy raises a copy of it
        return ActorError("a SimPy process", self.tag, "its generator", describe(cause)), cause
