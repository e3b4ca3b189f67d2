"""The discrete-event director: which actor fires when.

Events are ordered by tag, that is by time and then microstep. Within a tag, tokens whose delay is over are put into
their ports first, in the order in which they were sent; then actors fire by rank (``firing_order``: depth in the graph
of connections without delay, then priority, ties in the order of declaration). A firing sees all tokens that its actor
gets at this tag, because every actor that can still send to it within the tag has a lower rank. An actor therefore
fires once per tag; the exception is one with an output that does not depend on an input at once (``depends_on``),
which may have to send before that input has arrived: its tokens are taken in a separate firing, at the rank of the
input.

Where ties are posted (``postings``), actors of equal depth and priority fire in the order in which they were to have a
turn first: by requesting a wake-up, or by the arrival of a token.  Then an actor takes all tokens that wait for it, in
whichever of its turns it fires, and its consecutive turns are one firing.

A token sent over a connection without delay arrives at the same tag; with delay d > 0 at (time + d, 1); with delay 0
at the next microstep.  A wake-up for the present time comes at the next microstep, one for the future at
microstep 1.  The first tag of a run is (start, 1).

SimPy has the events of processes and resources, at whole nanoseconds, too.  The director has its own agenda beside
them: the earlier of the two goes first.  At one instant, all events of SimPy come first, and what processes send then
is received at the first microstep that the director has not yet handled.

Departures from Ptolemy II: a firing sees all tokens of its tag at once, where Ptolemy fires again for each further
token; and tokens that an actor does not read do not stay in the port, unless it keeps them (``InputPort.keep``).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NoReturn

from epicycle.actors import (
    Environment,
    InputPort,
    Moment,
    Posts,
    Process,
    Ranks,
    Streams,
    Tag,
    Times,
    Wake,
    Way,
    new_wake,
)

from ..text import NORMAL, Limits, describe
from . import errors
from .agenda import Delivery, Instant, Poster, Turn, new_instant
from .errors import ActorError, Crowd, CrowdError, LoopError

if TYPE_CHECKING:
    from epicycle.actors import Actor
    from epicycle.aspects import Job

    from ..graph import Postings

REPORTED = 256  # tokens that come together at one port are counted in groups of this size


class Director:
    """Fires the actors of one run."""

    __slots__ = (
        "_all_at_once", "_environment", "_has_simpy", "_is_interrupted", "_last", "_most_microsteps", "_most_steps",
        "_most_times", "_next", "_on_their_way", "_past", "_queue", "_rank", "_ready", "_reason", "_recent",
        "_stop_after", "_time", "_times", "_turns", "crowd", "firings", "posters", "present", "ranks", "seed", "steps",
        "streams", "watch",
    )  # fmt: skip

    def __init__(
        self, order: dict[str, int], seed: int, limits: Limits = NORMAL, postings: Postings | None = None
    ) -> None:
        self._environment = Environment()
        self._queue = self._environment.queue
        self._has_simpy = False  # whether anybody uses the environment
        self._time = 0  # SimPy's time until then
        self.seed = seed
        self.streams = Streams(seed)
        self.crowd = Crowd(limits.tokens)
        self._on_their_way = 0  # tokens, to future times and microsteps
        self._most_times = limits.times
        self.firings = 0
        self.steps = 0  # tags, and events of SimPy's
        # The tag that is being handled, also while its time has another; None between, while SimPy does things.
        self.present: Instant | None = None
        self._last = new_instant(0, 0)  # the latest tag that was handled, or is being handled
        self._past: Instant | None = None  # the one before it, which may serve again
        self.ranks = order  # of actors and of their inputs
        self._turns: list[Turn | None] = [None] * (max(order.values(), default=0) + 1)  # by rank
        # The work: at the present tag the ranks of turns (a heap), then the next microstep, then later times.
        # One entry per actor and tag, whatever the number of its tokens.
        self._ready = Ranks()
        self._all_at_once = {} if postings is None else postings.actors  # which take all waiting tokens
        self.posters: dict[str, Poster] = {}  # of composites that are posted as a whole
        if postings is not None:
            self._ready.posts = Posts(postings.places)
        self._next: Instant | None = None
        self._times = Times()
        self._rank = -1  # the rank of the turn handled now
        self._stop_after: Tag | None = None
        self._reason = "no events left"
        self._recent: list[str] | None = None  # actors that fire while time seems to stand still
        self._is_interrupted = False
        # Called with the time (ns) before it advances there; true if the run is to end instead.
        self.watch: Callable[[int], bool] | None = None
        self._most_microsteps = errors.MAX_MICROSTEPS
        self._most_steps = errors.MAX_STEPS  # of SimPy at one instant

    @property
    def tag(self) -> Tag:
        """The present tag: outside of firings (a process that SimPy resumed), the first one not yet handled."""
        return self.now().tag

    @property
    def time(self) -> int:
        """Its time (ns)."""
        return self.now().time

    @property
    def last(self) -> Tag:
        """The latest tag that was handled, or is being handled."""
        return self._last.tag

    @property
    def environment(self) -> Environment:
        """SimPy's part of the run, which is kept up to date once it has been requested."""
        if not self._has_simpy:
            self._has_simpy = True
            self._environment._now = self._time
        return self._environment

    def now(self) -> Instant:
        """The present tag, with its work if it is being handled."""
        if self.present is not None:
            return self.present
        now, last = self._environment.time if self._has_simpy else self._time, self._last
        return new_instant(now, 1) if now > last.time else new_instant(last.time, last.microstep + 1)

    # -- requests of actors and aspects ---------------------------------------------------------------------------

    def wake(self, actor: Actor, time: int) -> Wake:
        """Fire ``actor`` at ``time``; the present or past is the next microstep."""
        return self.wake_turn(self.turn(actor, self.ranks[actor.path]), time)

    def wake_turn(self, turn: Turn, time: int) -> Wake:
        """Give an actor a turn at ``time``."""
        now = self.now()
        if self.present is None and time <= now.time:
            return self._call_now(turn, now)
        return self._wake_at(turn, self._to_come(now, time))

    def call(self, actor: Actor, tag: Tag, rank: int) -> Wake:
        """Fire ``actor`` at a future tag and rank (``next_turn``)."""
        turn, now = self.turn(actor, rank), self.now()
        if tag.time == now.time and tag.microstep == now.microstep:
            return self._call_now(turn, now)
        return self._wake_at(turn, self._to_come(now, tag.time))

    def want_at(self, turn: Turn, time: int) -> Moment:
        """Give an actor a turn at ``time`` that cannot be cancelled; returns its tag."""
        now = self.now()
        if self.present is None and time <= now.time:
            self.want(turn)
            return now
        instant = self._to_come(now, time)
        instant.add(turn, None)
        if turn.poster is not None:
            turn.poster.note(instant.time, instant.microstep)
        return instant

    def _call_now(self, turn: Turn, now: Instant) -> Wake:
        wake = new_wake(now.time, now.microstep)
        turn.add(wake)
        self.want(turn)
        if turn.poster is not None:
            turn.poster.note(now.time, now.microstep)
        return wake

    def _wake_at(self, turn: Turn, instant: Instant) -> Wake:
        wake = new_wake(instant.time, instant.microstep)
        instant.add(turn, wake)
        if turn.poster is not None:
            turn.poster.note(instant.time, instant.microstep)
        return wake

    def turn(self, actor: Actor, rank: int) -> Turn:
        """The turn of a rank, for ``actor``: an actor of the model, or its stand-in."""
        turn = self._turns[rank]
        if turn is None:
            turn = self._turns[rank] = self.new_turn(actor, rank)
        return turn

    def new_turn(self, actor: Actor, rank: int) -> Turn:
        """A turn of an actor, or of its stand-in, at a rank."""
        turn = Turn(actor, rank, self.ranks, self._all_at_once.get(actor.path))
        around = actor.path
        while self.posters and around and turn.poster is None:
            around = around.rpartition(".")[0]
            turn.poster = self.posters.get(around)
        if turn.poster is not None:
            turn.nesting = turn.poster.nesting + 1
        return turn

    def entry(self, port: InputPort[Any], channel: int, stand_in: Actor | None = None) -> Way:
        """The way into a port at the present tag, which lets the port's actor, or its stand-in, fire."""
        return Entry(self, self.turn(stand_in or port.actor, self.ranks[port.path]), port, channel)

    def trigger(self, actor: Actor) -> None:
        """Fire ``actor`` at the present tag."""
        self.want(self.turn(actor, self.ranks[actor.path]))

    def later(self, delay: int, way: Way, token: Any) -> None:
        """Send a token onward after ``delay`` ns; 0 is the next microstep."""
        now = self.now()
        instant = self._to_come(now, now.time + delay)
        if instant.pending is None:
            instant.pending = []
        instant.pending.append(self.hold(way, token))
        self._on_their_way += 1
        if len(instant.pending) > self.crowd.most:
            raise CrowdError(instant.tag, self.crowd.most, "tokens on their way", self._who())
        if self._on_their_way > self._most_times:
            raise CrowdError(now.tag, self._most_times, "tokens on their way, over all times", self._who())

    def hold(self, way: Way, token: Any) -> Delivery:
        """A function that sends a token onward, later."""
        return Delivery(way, token)

    def stop(self, reason: str) -> None:
        """End the run when the present tag has been handled; the first call gives the reason."""
        if self._stop_after is None:
            self._stop_after = self.tag
            self._reason = reason

    def next_turn(self, rank: int) -> Tag:
        """The first tag at which a turn of this rank is still to come."""
        now = self.tag
        is_over = self.present is not None and self._rank >= rank
        return Tag(now.time, now.microstep + 1) if is_over else now

    def is_between(self, first: int, last: int) -> bool:
        """Whether none of the turns of these ranks is being taken."""
        return self.present is None or not first <= self._rank <= last

    def is_to_come(self, first: int, last: int) -> bool:
        """Whether a turn of these ranks is still to come at the present tag, and none of them is being taken."""
        if self.present is None or first <= self._rank <= last:
            return False
        return any(turn is not None and turn.is_wanted for turn in self._turns[first : last + 1])

    def set_aside(self, job: Job) -> None:
        """A firing is deferred: its tokens and wake-ups do not belong to its actor's next firing."""

    def put_back(self, job: Job) -> None:
        """A deferred firing is its actor's next one."""

    # -- the agenda -----------------------------------------------------------------------------------------------

    def _who(self) -> tuple[str, ...]:
        """The actor that fires now."""
        turn = None if self._rank < 0 else self._turns[self._rank]
        return () if turn is None else (turn.actor.path,)

    def want(self, turn: Turn) -> None:
        """Give an actor a turn at the present tag."""
        if not turn.is_wanted:
            turn.is_wanted = True
            self._ready.push(turn.rank)
            if self.present is None:
                self._await_present()

    def _to_come(self, now: Instant, time: int) -> Instant:
        """The work after the present tag: at the next microstep, or at the first one of a later time."""
        if time > now.time:
            instant = self._times.at(time)
            return self._await(time, 1) if instant is None else instant
        if self._next is None:
            self._next = new_instant(now.time, now.microstep + 1)
            if self.present is None:
                self._await_present()
        return self._next

    def _await_present(self) -> None:
        """Between tags: make sure that the present one will be handled."""
        now = self.now()
        if self._times.at(now.time) is None:
            self._await(now.time, now.microstep)

    def _await(self, time: int, microstep: int) -> Instant:
        """Put a tag into the agenda."""
        if self._times.size > self._most_times:
            what = "times with something still to come"
            raise CrowdError(Tag(time, microstep), self._most_times, what, self._who())
        past, self._past = self._past, None
        instant = new_instant(time, microstep, past)
        self._times.add(instant)
        return instant

    # -- time -----------------------------------------------------------------------------------------------------

    def _handle(self, instant: Instant) -> None:
        turns, ready = self._turns, self._ready
        if ready.posts is not None:
            ready.posts.settle()
            instant.arrange()
        if instant.turn is not None:
            self._wake_up(instant.turn, instant.wake)
        if instant.turns is not None and instant.wakes is not None:
            for place in range(len(instant.turns)):
                self._wake_up(instant.turns[place], instant.wakes[place])
        if instant.pending is not None:
            self._rank = -1
            self._begin(instant)
            for delivery in instant.pending:
                delivery.arrive()
            self._on_their_way -= len(instant.pending)
        turn = None
        try:
            while ready.size:
                turn = turns[ready.pop()]
                assert turn is not None
                turn.is_wanted = False
                self._rank = turn.rank
                if turn.takes_all:
                    if not self._gather(turn):
                        continue
                elif turn.wake is not None and not self.use_wakes(turn):
                    continue
                if self.present is not instant:
                    self._begin(instant)
                self.fire(turn)
                turn.clear()
        except BaseException as error:  # anything that an actor raises, even sys.exit(), is its failure
            assert turn is not None
            turn.clear()
            self.fail(turn, error)
        # Its next microstep comes next, even if nobody fired at this one: a process may have requested it.
        self.present = None if self._next is None else instant

    def _gather(self, turn: Turn) -> bool:
        """Give an actor that takes all waiting tokens its next turns, too.

        False if it has no reason to fire.
        """
        is_to_fire = self._has_reason(turn)
        posts = self._ready.posts
        while posts is not None and posts.first() >= 0:
            other = self._turns[posts.first()]
            assert other is not None
            if other.actor is not turn.actor:
                break
            self._ready.pop()
            other.is_wanted = False
            is_to_fire = self._has_reason(other) or is_to_fire
        return is_to_fire

    def _has_reason(self, turn: Turn) -> bool:
        if turn.wake is not None:
            return self.use_wakes(turn)
        return turn.is_own or turn.fires_for_nothing or turn.new() > 0

    def _wake_up(self, turn: Turn, wake: Wake | None) -> None:
        if wake is not None:
            turn.add(wake)
        if not turn.is_wanted:
            turn.is_wanted = True
            self._ready.push(turn.rank)

    def _begin(self, instant: Instant) -> None:
        """Something happens at a tag, for the first time."""
        self._past, self._last, self.present = self._last, instant, instant
        if instant.microstep > self._most_microsteps - 10:
            if instant.microstep > self._most_microsteps:
                raise LoopError(instant.time, tuple(dict.fromkeys(self._recent or ())))
            self._recent = self._recent or []
        else:
            self._recent = None

    def use_wakes(self, turn: Turn) -> bool:
        """Make the wake-ups of a turn due; false if the actor has no reason left to fire."""
        return turn.use_wakes()

    def fire(self, turn: Turn) -> None:
        """Let an actor fire, in its turn."""
        if self._is_interrupted:
            raise KeyboardInterrupt
        self.firings += 1
        if self._recent is not None:
            self._recent.append(turn.actor.path)
        if turn.later:
            turn.hold()
        if turn.form is not None:
            turn.form.fire()
        elif turn.keeps is None:
            turn.actor.fire()
        else:
            self._fire_on(turn)

    def _fire_on(self, turn: Turn) -> None:
        """Let an actor fire as long as it takes tokens from ports that keep them, and leaves others there."""
        waiting = turn.kept()
        turn.actor.fire()
        left = turn.kept()
        while 0 < left < waiting:
            turn.clear()
            if turn.later:
                turn.hold()
            self.firings += 1
            waiting = left
            turn.actor.fire()
            left = turn.kept()

    def fail(self, turn: Turn, error: BaseException) -> NoReturn:
        """Report the error of an actor in its turn; one of an aspect on a token's way, say, has been reported."""
        if isinstance(error, (ActorError, LoopError, KeyboardInterrupt)):
            raise error
        doing = "run()" if isinstance(turn.actor, Process) else "fire()"
        raise ActorError(turn.actor.path, self.last, doing, describe(error)) from error

    def interrupt(self) -> None:
        """Raise ``KeyboardInterrupt`` instead of the next firing, or of the next instant."""
        self._is_interrupted = True


class Entry(Way):
    """The end of a token's way: a port of an actor, on one channel."""

    __slots__ = ("channel", "director", "is_plain", "port", "turn")

    def __init__(self, director: Director, turn: Turn, port: InputPort[Any], channel: int) -> None:
        self.director = director
        self.turn = turn
        self.port = port
        self.channel = channel
        self.is_plain = type(port) is InputPort and port.width == 1
        port.open()

    def go(self, token: Any) -> None:
        """Put a token in."""
        turn = self.turn
        if self.is_plain:
            self.port.arrived.append(token)
        else:
            self.port.receive(token, self.channel)
        if not turn.is_wanted:  # as in want, without the call: this happens for every token that arrives
            turn.is_wanted = True
            self.director._ready.push(turn.rank)
            if self.director.present is None:
                self.director._await_present()
        elif not len(self.port.arrived) % REPORTED:
            self.director.crowd.add(self.director.tag, self.port.path, REPORTED)
