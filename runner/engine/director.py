"""The discrete-event director: which actor fires when.

Events are ordered by tag, that is by time and then microstep. Within a tag, tokens whose delay is over are put into
their ports first, in the order in which they were sent; then actors fire by rank (``firing_order``: depth in the graph
of connections without delay, then priority, ties in the order of declaration). A firing sees all tokens that its actor
gets at this tag, because every actor that can still send to it within the tag has a lower rank. An actor therefore
fires once per tag; the exception is one with an output that does not depend on an input at once (``depends_on``),
which may have to send before that input has arrived: its tokens are taken in a separate firing, at the rank of the
input.

A token sent over a connection without delay arrives at the same tag; with delay d > 0 at (time + d, 1); with delay 0
at the next microstep.  A wake-up for the present time comes at the next microstep, one for the future at
microstep 1.  The first tag of a run is (start, 1).

SimPy has the events of processes and resources, at whole nanoseconds, too.  The director has its own agenda beside
them: the earlier of the two goes first.  At one instant, all events of SimPy come first, and what processes send then
is received at the first microstep that the director has not yet handled.

Departures from Ptolemy II: a firing sees all tokens of its tag at once, where Ptolemy fires again for each further
token; and tokens that an actor does not read do not stay in the port.

Another director is a subclass, which a dialect names (``catalogue.Dialect.director``).  It may decide in which turn an
actor takes which tokens (``inputs_at``), which turn is next (``line_up``, ``next_turn``), whether it leads to a firing
(``has_reason``), what happens at the begin of a tag (``handle``), and what the borders of composites do
(``composites``).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NoReturn

from epicycle.actors import (
    Environment,
    InputPort,
    Moment,
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
from .agenda import Delivery, Instant, Turn, new_instant
from .errors import ActorError, Crowd, CrowdError, LoopError

if TYPE_CHECKING:
    from epicycle.actors import Actor
    from epicycle.aspects import Job

    from ..graph import ModelGraph

REPORTED = 256  # tokens that come together at one port are counted in groups of this size


class Director:
    """Fires the actors of one run."""

    __slots__ = (
        "_environment", "_has_simpy", "_is_interrupted", "_last", "_most_microsteps", "_most_steps",
        "_most_times", "_next", "_on_their_way", "_past", "_queue", "_ready", "_reason", "_recent",
        "_stop_after", "_time", "_times", "crowd", "firings", "present", "rank", "ranks", "seed", "steps",
        "streams", "turns", "watch",
    )  # fmt: skip

    # The subclass of ``Directors`` that makes the borders of composites; None is the usual one.
    composites: Any = None

    def __init__(
        self, order: dict[str, int], seed: int, limits: Limits = NORMAL, graph: ModelGraph | None = None
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
        self.turns: list[Turn | None] = [None] * (max(order.values(), default=0) + 1)  # by rank
        # The work: at the present tag the ranks of turns (a heap), then the next microstep, then later times.
        # One entry per actor and tag, whatever the number of its tokens.
        self._ready = Ranks()
        self._next: Instant | None = None
        self._times = Times()
        self.rank = -1  # the rank of the turn handled now
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
        """Fire ``actor`` at a future tag and rank (``next_tag``)."""
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
        return instant

    def _call_now(self, turn: Turn, now: Instant) -> Wake:
        wake = new_wake(now.time, now.microstep)
        turn.add(wake)
        self.want(turn)
        return wake

    def _wake_at(self, turn: Turn, instant: Instant) -> Wake:
        wake = new_wake(instant.time, instant.microstep)
        instant.add(turn, wake)
        return wake

    def turn(self, actor: Actor, rank: int) -> Turn:
        """The turn of a rank, for ``actor``: an actor of the model, or its stand-in."""
        turn = self.turns[rank]
        if turn is None:
            turn = self.turns[rank] = self.new_turn(actor, rank)
        return turn

    def new_turn(self, actor: Actor, rank: int) -> Turn:
        """A turn of an actor, or of its stand-in, at a rank."""
        ports = [port for port in self.inputs_at(actor, rank) if port.width]
        connected = [port for port in actor.inputs.values() if port.width and port not in ports]
        return Turn(actor, rank, ports, [port for port in connected if self.ranks[port.path] > rank])

    def inputs_at(self, actor: Actor, rank: int) -> list[InputPort[Any]]:
        """The inputs whose tokens an actor takes in its turn at a rank."""
        return [port for port in actor.inputs.values() if self.ranks[port.path] == rank]

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

    def next_tag(self, rank: int) -> Tag:
        """The first tag at which a turn of this rank is still to come."""
        now = self.tag
        is_over = self.present is not None and self.rank >= rank
        return Tag(now.time, now.microstep + 1) if is_over else now

    def set_aside(self, job: Job) -> None:
        """A firing is deferred: its tokens and wake-ups do not belong to its actor's next firing."""

    def put_back(self, job: Job) -> None:
        """A deferred firing is its actor's next one."""

    # -- the agenda -----------------------------------------------------------------------------------------------

    def _who(self) -> tuple[str, ...]:
        """The actor that fires now."""
        turn = None if self.rank < 0 else self.turns[self.rank]
        return () if turn is None else (turn.actor.path,)

    def want(self, turn: Turn) -> None:
        """Give an actor a turn at the present tag."""
        if not turn.is_wanted:
            self.line_up(turn)
            if self.present is None:
                self._await_present()

    def line_up(self, turn: Turn) -> None:
        """Add a turn to those of the present tag, from which ``next_turn`` takes."""
        turn.is_wanted = True
        self._ready.push(turn.rank)

    def next_turn(self) -> Turn | None:
        """The next turn at the present tag, which is no longer lined up; None if there is none."""
        if not self._ready.size:
            return None
        turn = self.turns[self._ready.pop()]
        assert turn is not None
        turn.is_wanted = False
        self.rank = turn.rank
        return turn

    def has_reason(self, turn: Turn) -> bool:
        """Whether an actor is to fire in its turn: its wake-ups may all have been cancelled."""
        return turn.wake is None or self.use_wakes(turn)

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

    def handle(self, instant: Instant) -> None:
        """Handle a tag, which is the next one."""
        if instant.turn is not None:
            self._wake_up(instant.turn, instant.wake)
        if instant.turns is not None and instant.wakes is not None:
            for place in range(len(instant.turns)):
                self._wake_up(instant.turns[place], instant.wakes[place])
        if instant.pending is not None:
            self.rank = -1
            self._begin(instant)
            for delivery in instant.pending:
                delivery.arrive()
            self._on_their_way -= len(instant.pending)
        turn = None
        try:
            while True:
                turn = self.next_turn()
                if turn is None:
                    break
                if not self.has_reason(turn):
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

    def _wake_up(self, turn: Turn, wake: Wake | None) -> None:
        if wake is not None:
            turn.add(wake)
        if not turn.is_wanted:
            self.line_up(turn)

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
        if turn.form is None:
            turn.actor.fire()
        else:
            turn.form.fire()

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
        if not turn.is_wanted:
            self.director.want(turn)
        elif not len(self.port.arrived) % REPORTED:
            self.director.crowd.add(self.director.tag, self.port.path, REPORTED)
