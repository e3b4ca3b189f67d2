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

Actors react, or are SimPy processes; one director orders both.  It also lets the events of processes and resources
happen (``Environment``), at whole nanoseconds, too.  At one instant, all of these events come first, and what processes
send then is received at the first microstep that the director has not yet handled.

Departures from Ptolemy II: a firing sees all tokens of its tag at once, where Ptolemy fires again for each further
token; and tokens that an actor does not read do not stay in the port.

Another director is a subclass, which a dialect names (``catalogue.Dialect.director``).  It may decide in which
activation an actor takes which tokens (``inputs_at``), which activation is next (``enqueue``, ``next_activation``),
whether it leads to a firing (``has_reason``), what happens at the begin of a tag (``handle``), and what the borders of
composites do (``composites``).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NoReturn

from simpy.events import Event, EventPriority

from epicycle.actors import (
    Environment,
    Events,
    InputPort,
    Moment,
    Process,
    ReadyQueue,
    Receiver,
    Streams,
    Tag,
    TimedQueue,
    Wake,
    new_wake,
)

from ...model.text.limits import NORMAL, Limits
from ...model.text.program import describe
from . import errors
from .agenda import Activation, Delivery, Instant, new_instant
from .errors import ActorError, Crowd, CrowdError, LoopError

if TYPE_CHECKING:
    from epicycle.actors import Actor
    from epicycle.aspects import Job

    from ...model.graph.model_graph import ModelGraph

NO_EVENTS = "no events left"  # why a run ends that nothing else ends
REPORTED = 256  # tokens that come together at one port are counted in groups of this size


class Director:
    """Fires the actors of one run."""

    __slots__ = (
        "_environment", "_is_interrupted", "_last", "_latest", "_most_microsteps", "_most_steps", "_most_times",
        "_next", "_on_their_way", "_past", "_queue", "_ready", "_reason", "_recent", "_stop_after", "_time", "_times",
        "activations", "crowd", "events", "firings", "is_plain", "present", "rank", "ranks", "seed", "steps",
        "streams", "watch",
    )  # fmt: skip

    # The subclass of ``Directors`` that makes the borders of composites; None is the usual one.
    composites: Any = None

    def __init__(
        self, order: dict[str, int], seed: int, limits: Limits = NORMAL, graph: ModelGraph | None = None
    ) -> None:
        self.events = Events()
        self._environment: Environment | None = None  # made for the first process
        self._time = 0  # of the latest instant or event
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
        self.activations: list[Activation | None] = [None] * (max(order.values(), default=0) + 1)  # by rank
        # The work: at the present tag the ranks of activations (a heap), then the next microstep, then later times.
        # One entry per actor and tag, whatever the number of its tokens.
        self._ready = ReadyQueue()
        self._next: Instant | None = None
        self._times = TimedQueue()  # instants
        self._latest: Instant | None = None  # of them, the one that was added last
        self.rank = -1  # the rank of the activation handled now
        self.is_plain = type(self) is Director  # a subclass may have another order
        self._stop_after: Tag | None = None
        self._reason = NO_EVENTS
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
        return self.now().time if self.present is None else self.present.time

    @property
    def last(self) -> Tag:
        """The latest tag that was handled, or is being handled."""
        return self._last.tag

    @property
    def environment(self) -> Environment:
        """The environment for processes and resources, whose events this director lets happen."""
        if self._environment is None:
            self._environment = Environment(self)
        return self._environment

    @property
    def next_event(self) -> int:
        """The time of the next event of SimPy's (ns)."""
        time: int = self.events.first
        return time

    @property
    def next_time(self) -> int:
        """The time of the next tag (ns); ``NEVER`` if there is none."""
        return self._times.first()

    def put_event(self, event: Event, priority: EventPriority, delay: int) -> None:
        """Let an event of SimPy's happen after ``delay`` ns."""
        self.events.put(self._time + delay, priority, event)

    def now(self) -> Instant:
        """The present tag, with its work if it is being handled."""
        if self.present is not None:
            return self.present
        now, last = self._time, self._last
        return new_instant(now, 1) if now > last.time else new_instant(last.time, last.microstep + 1)

    # -- requests of actors and aspects ---------------------------------------------------------------------------

    def wake(self, actor: Actor, time: int) -> Wake:
        """Fire ``actor`` at ``time``; the present or past is the next microstep."""
        rank = self.ranks[actor.path]
        return self.wake_activation(self.activations[rank] or self.activation(actor, rank), time)

    def wake_activation(self, activation: Activation, time: int) -> Wake:
        """Give an actor an activation at ``time``."""
        now = self.now() if self.present is None else self.present
        if self.present is None and time <= now.time:
            return self._call_now(activation, now)
        return self._wake_at(activation, self._to_come(now, time))

    def call(self, actor: Actor, tag: Tag, rank: int) -> Wake:
        """Fire ``actor`` at a future tag and rank (``next_tag``)."""
        activation, now = self.activation(actor, rank), self.now()
        if tag.time == now.time and tag.microstep == now.microstep:
            return self._call_now(activation, now)
        return self._wake_at(activation, self._to_come(now, tag.time))

    def schedule_at(self, activation: Activation, time: int) -> Moment:
        """Give an actor an activation at ``time`` that cannot be cancelled; returns its tag."""
        now = self.now()
        if self.present is None and time <= now.time:
            self.schedule(activation)
            return now
        instant = self._to_come(now, time)
        instant.add(activation, None)
        return instant

    def _call_now(self, activation: Activation, now: Instant) -> Wake:
        wake = new_wake(now.time, now.microstep)
        activation.add(wake)
        self.schedule(activation)
        return wake

    def _wake_at(self, activation: Activation, instant: Instant) -> Wake:
        wake = new_wake(instant.time, instant.microstep)
        instant.add(activation, wake)
        return wake

    def activation(self, actor: Actor, rank: int) -> Activation:
        """The activation of a rank, for ``actor``: an actor of the model, or its stand-in."""
        activation = self.activations[rank]
        if activation is None:
            activation = self.activations[rank] = self.new_activation(actor, rank)
        return activation

    def new_activation(self, actor: Actor, rank: int) -> Activation:
        """An activation of an actor, or of its stand-in, at a rank."""
        ports = [port for port in self.inputs_at(actor, rank) if port.width]
        connected = [port for port in actor.inputs.values() if port.width and port not in ports]
        return Activation(actor, rank, ports, [port for port in connected if self.ranks[port.path] > rank])

    def inputs_at(self, actor: Actor, rank: int) -> list[InputPort[Any]]:
        """The inputs whose tokens an actor takes in its activation at a rank."""
        return [port for port in actor.inputs.values() if self.ranks[port.path] == rank]

    def entry(self, port: InputPort[Any], channel: int, stand_in: Actor | None = None) -> Receiver:
        """The way into a port at the present tag, which lets the port's actor, or its stand-in, fire."""
        return Entry(self, self.activation(stand_in or port.actor, self.ranks[port.path]), port, channel)

    def trigger(self, actor: Actor) -> None:
        """Fire ``actor`` at the present tag."""
        self.schedule(self.activation(actor, self.ranks[actor.path]))

    def later(self, delay: int, way: Receiver, token: Any) -> None:
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

    def hold(self, way: Receiver, token: Any) -> Delivery:
        """A function that sends a token onward, later."""
        return Delivery(way, token)

    def stop(self, reason: str) -> None:
        """End the run when the present tag has been handled; the first call gives the reason."""
        if self._stop_after is None:
            self._stop_after = self.tag
            self._reason = reason

    def next_tag(self, rank: int) -> Tag:
        """The first tag at which an activation of this rank is still to come."""
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
        activation = None if self.rank < 0 else self.activations[self.rank]
        return () if activation is None else (activation.actor.path,)

    def schedule(self, activation: Activation) -> None:
        """Give an actor an activation at the present tag."""
        if not activation.is_scheduled:
            self.enqueue(activation)
            if self.present is None:
                self._await_present()

    def enqueue(self, activation: Activation) -> None:
        """Add an activation to those of the present tag, from which ``next_activation`` takes."""
        activation.is_scheduled = True
        self._ready.push(activation.rank)

    def next_activation(self) -> Activation | None:
        """The next activation at the present tag, which is no longer lined up; None if there is none."""
        rank = self._ready.pop()
        if rank < 0:
            return None
        activation = self.activations[rank]
        assert activation is not None
        activation.is_scheduled = False
        self.rank = rank
        return activation

    def has_reason(self, activation: Activation) -> bool:
        """Whether an actor is to fire in its activation: its wake-ups may all have been cancelled."""
        return activation.wake is None or self.use_wakes(activation)

    def _to_come(self, now: Instant, time: int) -> Instant:
        """The work after the present tag: at the next microstep, or at the first one of a later time."""
        if time > now.time:  # several instants may be of one time; they join when it comes
            latest = self._latest
            return latest if latest is not None and latest.time == time else self._await(time, 1)
        if self._next is None:
            self._next = new_instant(now.time, now.microstep + 1)
            if self.present is None:
                self._await_present()
        return self._next

    def _await_present(self) -> None:
        """Between tags: make sure that the present one will be handled."""
        now = self.now()
        if self._times.first() != now.time:
            self._await(now.time, now.microstep)

    def _await(self, time: int, microstep: int) -> Instant:
        """Put a tag into the agenda."""
        past, self._past = self._past, None
        self._latest = instant = new_instant(time, microstep, past)
        if self._times.put(time, microstep, None, instant) > self._most_times + 1:
            what = "times with something still to come"
            raise CrowdError(Tag(time, microstep), self._most_times, what, self._who())
        return instant

    def take(self) -> Instant:
        """Take the next tag out of the agenda, with everything it is to do."""
        instant: Instant = self._times.pop()
        latest = self._latest
        if latest is not None and latest.time == instant.time:
            self._latest = None
        while self._times.first() == instant.time:
            instant.join(self._times.pop())
        return instant

    # -- time -----------------------------------------------------------------------------------------------------

    def handle(self, instant: Instant) -> None:
        """Handle a tag, which is the next one."""
        if instant.activation is not None:
            self._wake_up(instant.activation, instant.wake)
        if instant.activations is not None and instant.wakes is not None:
            for place in range(len(instant.activations)):
                self._wake_up(instant.activations[place], instant.wakes[place])
        if instant.pending is not None:
            self.rank = -1
            self._begin(instant)
            for delivery in instant.pending:
                delivery.arrive()
            self._on_their_way -= len(instant.pending)
        activation, ready, is_plain = None, self._ready, self.is_plain
        try:
            while True:
                if is_plain:  # as in next_activation and has_reason, without the calls: this happens for every firing
                    rank = ready.pop()
                    if rank < 0:
                        break
                    activation = self.activations[rank]
                    assert activation is not None
                    activation.is_scheduled = False
                    self.rank = rank
                    if activation.wake is not None and not activation.use_wakes():
                        continue
                elif (activation := self.next_activation()) is None:
                    break
                elif not self.has_reason(activation):
                    continue
                if self.present is not instant:
                    self._begin(instant)
                self.fire(activation)
                activation.clear()
        except BaseException as error:  # anything that an actor raises, even sys.exit(), is its failure
            assert activation is not None
            activation.clear()
            self.fail(activation, error)
        # Its next microstep comes next, even if nobody fired at this one: a process may have requested it.
        self.present = None if self._next is None else instant

    def _wake_up(self, activation: Activation, wake: Wake | None) -> None:
        if wake is not None:
            activation.add(wake)
        if not activation.is_scheduled:
            self.enqueue(activation)

    def _begin(self, instant: Instant) -> None:
        """Something happens at a tag, for the first time."""
        self._past, self._last, self.present = self._last, instant, instant
        if instant.microstep > self._most_microsteps - 10:
            if instant.microstep > self._most_microsteps:
                raise LoopError(instant.time, tuple(dict.fromkeys(self._recent or ())))
            self._recent = self._recent or []
        else:
            self._recent = None

    def use_wakes(self, activation: Activation) -> bool:
        """Make the wake-ups of an activation due; false if the actor has no reason left to fire."""
        return activation.use_wakes()

    def fire(self, activation: Activation) -> None:
        """Let an actor fire, in its activation."""
        if self._is_interrupted:
            raise KeyboardInterrupt
        self.firings += 1
        if self._recent is not None:
            self._recent.append(activation.actor.path)
        if activation.later:
            activation.hold()
        if activation.form is None:
            activation.actor.fire()
        else:
            activation.form.fire()

    def fail(self, activation: Activation, error: BaseException) -> NoReturn:
        """Report the error of an actor in its activation; one of an aspect on a token's way, say, has been reported."""
        if isinstance(error, (ActorError, LoopError, KeyboardInterrupt)):
            raise error
        doing = "run()" if isinstance(activation.actor, Process) else "fire()"
        raise ActorError(activation.actor.path, self.last, doing, describe(error)) from error

    def interrupt(self) -> None:
        """Raise ``KeyboardInterrupt`` instead of the next firing, or of the next instant."""
        self._is_interrupted = True


class Entry(Receiver):
    """The end of a token's way: a port of an actor, on one channel."""

    __slots__ = ("activation", "channel", "director", "is_plain", "port")

    def __init__(self, director: Director, activation: Activation, port: InputPort[Any], channel: int) -> None:
        self.director = director
        self.activation = activation
        self.port = port
        self.channel = channel
        self.is_plain = type(port) is InputPort and port.width == 1
        port.open()

    def put(self, token: Any) -> None:
        """Put a token in."""
        activation = self.activation
        if self.is_plain:
            self.port.arrived.append(token)
        else:
            self.port.receive(token, self.channel)
        if not activation.is_scheduled:
            director = self.director
            if director.is_plain and director.present is not None:  # as in schedule, without the calls
                activation.is_scheduled = True
                director._ready.push(activation.rank)
            else:
                director.schedule(activation)
        elif not len(self.port.arrived) % REPORTED:
            self.director.crowd.add(self.director.tag, self.port.path, REPORTED)
