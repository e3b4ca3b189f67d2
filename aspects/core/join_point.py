"""JoinPoint: a place to which an aspect is attached; and the common part of aspects that act at such places.

The weaving contract
--------------------
There are three kinds of aspects, by what passes them: tokens at ports (``PortAspect``), firings of actors
(``ExecutionAspect``), and the time that actors see (``ClockAspect``).  The engine makes one aspect object per
declaration and one ``JoinPoint`` for each port or actor that its pointcut selects.  For every token or firing that
passes a join point it calls ``pass_token`` or ``schedule``.  That decides what continues by calling ``point.forward``
never, once or several times, now or (with ``delay``) later, and what is noted by calling ``point.act(...)``.  A single
``point.forward(token)`` leaves no trace.

Aspects at the same port apply in the order of their declaration, the first one outermost (nearest to the sender).
An aspect acts while it is *active*: from ``from`` until ``until`` (again every ``every``), and ``when`` a condition
over ports holds.  At other times everything passes unchanged, and the aspect is not called.  It may read the latest
tokens of ports (``PortsParameter``, ``reads``, ``point.latest``), and changes only what passes it.

Each join point has its own random stream, keyed by the names of aspect and place: adding, removing or re-aiming an
aspect moves no stream of an actor, of another aspect, or of the same aspect at another place.  An aspect should draw
the same number of random values whatever its strength, so that runs at different strengths can be paired.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar, Generic, Protocol, Self, TypeVar

from epicycle.actors import EpicycleError, Parameter, Stream, Streams, Tag, to_nanoseconds, to_seconds
from epicycle.actors.expression import PortFormula, PortFormulaParameter, value_at

from .aspect import Aspect

TOKEN = "token"  # the name of the passing token in expressions over ports
Reading = tuple[str, tuple[str, ...]]  # an output port, and the fields that lead to a part of its token
Selection = Mapping[str, Sequence[str]]  # patterns, and the full paths that they select


class AspectContext(Protocol):
    """The interface that the engine offers to a join point."""

    @property
    def tag(self) -> Tag:
        """The present tag."""

    @property
    def streams(self) -> Streams:
        """The random streams of the run."""

    def forward(self, token: Any) -> None:
        """Let a token continue behind the aspect."""

    def enter(self, token: Any) -> None:
        """Let a token into the composite, for an aspect that is a model."""

    def later(self, delay: int, deliver: Callable[[Any], None], token: Any) -> None:
        """Call ``deliver(token)`` after ``delay`` ns; 0 is the next microstep."""

    def hold(self, deliver: Callable[[Any], None], token: Any) -> Callable[[], None]:
        """``deliver(token)``, to be called later."""

    def latest(self, port: str) -> Any:
        """The latest token of an output port; None if it has sent nothing yet."""

    def note(self, place: Place, event: str, token: Any) -> None:
        """Write an act of the aspect at a place into the event log."""

    def record(self, signal: str, token: Any) -> None:
        """Append a token to a signal among the results of the run."""

    def stop(self, reason: str) -> None:
        """End the run when the present tag has been handled; the first call gives the reason."""

    def blame(self, doing: str, error: Exception) -> Exception:
        """The error to raise for one of the aspect, with what it was doing."""

    def during(self, handling: Any) -> AspectContext:
        """The same for one token, of which ``handling`` says what happens to it."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where an aspect acts: a port, or an actor.

    ``key`` names its random stream and memory: the path, or the connection, for an aspect on a single one.
    ``readings`` are the ports read by the aspect's expressions, ``selections`` the paths selected by its parameters
    with patterns.
    """

    aspect: str
    port: str  # or parameter, or actor
    key: str
    source: str  # the port that tokens come from, at an output the port itself
    is_actor: bool = False
    readings: Mapping[PortFormula, Sequence[Reading]] = field(default_factory=dict)
    selections: Mapping[str, Selection] = field(default_factory=dict)
    owner: str = field(init=False)  # the actor, or the actor or composite whose port this is
    name: str = field(init=False)  # of the port; empty for an actor

    def __post_init__(self) -> None:
        owner, _, name = (self.port, "", "") if self.is_actor else self.port.rpartition(".")
        object.__setattr__(self, "owner", owner)
        object.__setattr__(self, "name", name)


@dataclass(eq=False, slots=True)
class Memory:
    """What an aspect keeps at a place, over all connections to it."""

    shared: dict[Any, Any] = field(default_factory=dict)  # with all its places
    own: dict[Any, Any] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    stream: Stream | None = None


class JoinPoint:
    """A place to which an aspect is attached: a port, or a single connection to it.

    ``counts`` holds how often each event happened here.  ``memory`` belongs to the aspect, for data about this port
    that it keeps between tokens; ``shared`` is common to all its ports.  ``source`` is the port that tokens come from
    over the connection, at an output the port itself; ``owner`` is the actor or composite whose port it is.
    """

    def __init__(self, place: Place, memory: Memory, context: AspectContext) -> None:
        self.place = place
        self.aspect, self.port, self.owner, self.source = place.aspect, place.port, place.owner, place.source
        self.counts, self.memory, self.shared = memory.counts, memory.own, memory.shared
        self._memory = memory
        self._context = context

    @cached_property
    def random(self) -> Stream:
        """The random stream of the aspect at this place, made on first use."""
        if self._memory.stream is None:
            self._memory.stream = aspect_stream(self._context.streams, self.place.key, self.aspect)
        return self._memory.stream

    def during(self, handling: Any) -> Self:
        """Engine: the same place for one token, as ``AspectContext.during``; what does not happen is not counted."""
        made = copy.copy(self)
        made._context = self._context.during(handling)
        if not handling.happens:
            made.counts = {}
        return made

    def is_at(self, other: JoinPoint) -> bool:
        """Whether it is the same place of the same aspect: a single token may have a join point of its own."""
        return self._memory is other._memory

    @property
    def tag(self) -> Tag:
        """The present tag."""
        return self._context.tag

    @property
    def now(self) -> float:
        """The present time in seconds."""
        return to_seconds(self._context.tag.time)

    def latest(self, port: str) -> Any:
        """The latest token of an output port that the aspect ``reads``; None if it has sent nothing yet."""
        return self._context.latest(port)

    def value_of(self, formula: PortFormula, **given: object) -> Any:
        """The present value of a parameter of the aspect that is an expression over ports and ``given`` names.

        None as long as one of its ports has sent nothing; raises ``EpicycleError``.
        """
        values = []
        for port, fields in self.place.readings.get(formula, ()):
            latest = self._context.latest(port)
            if latest is None:
                return None
            values.append(value_at(latest, fields))
        return formula(values, **given)

    def selected(self, parameter: str) -> Selection:
        """The full paths selected by each pattern in a ``SelectionParameter`` of the aspect."""
        return self.place.selections.get(parameter, {})

    def forward(self, token: Any, delay: float | None = None) -> None:
        """Let a token pass, at once or after ``delay`` seconds (0 is the next microstep)."""
        if delay is None:
            self._context.forward(token)
        else:
            self._context.later(to_nanoseconds(delay), self._context.forward, token)

    def enter(self, token: Any) -> None:
        """Let a token into the composite, for an aspect that is a model."""
        self._context.enter(token)

    def delay(self, token: Any, seconds: float) -> None:
        """Let a token pass after some seconds, and note that as ``delayed``; at once and without a trace after none."""
        if seconds == 0.0:
            self.forward(token)
        else:
            self.act("delayed", token, seconds)
            self.forward(token, seconds)

    def hold(self, token: Any) -> Callable[[], None]:
        """A function that lets a token pass: ``forward`` for a later time."""
        return self._context.hold(self._context.forward, token)

    def later(self, delay: float, call: Callable[[Any], None], what: Any) -> None:
        """Call ``call(what)`` after ``delay`` seconds (0 is the next microstep), for decisions at that time."""
        self._context.later(to_nanoseconds(delay), call, what)

    def count(self, event: str) -> None:
        """Count an event for the summary, without an entry in the log."""
        self.counts[event] = self.counts.get(event, 0) + 1

    def act(self, event: str, token: Any, *details: Any) -> None:
        """Count an event and write it into the event log: the token as it came, then the details.

        Details are a new token or a delay in seconds; with details the logged value is a list.
        """
        self.count(event)
        self._context.note(self.place, event, [token, *details] if details else token)

    def record(self, token: Any) -> None:
        """Append a token to the signal of this join point, ``aspect@port``, among the results of the run."""
        self._context.record(f"{self.aspect}@{self.port}", token)

    def stop(self) -> None:
        """End the run when the present tag has been handled; the aspect is given as the reason."""
        self._context.stop(f"aspect {self.aspect}")

    def blame(self, doing: str, error: Exception) -> Exception:
        """Engine: the error to raise for one of the aspect here."""
        return self._context.blame(doing, error)


def aspect_stream(streams: Streams, place: str, aspect: str) -> Stream:
    """The random stream of an aspect at a place: a port, a connection, an actor."""
    return streams.of(place, f"aspect {aspect}")


Passing = TypeVar("Passing")  # a token, or a firing
Point = TypeVar("Point", bound=JoinPoint)


class JoinPointAspect(Aspect, Generic[Passing, Point]):
    """The common part of port aspects and execution aspects: they act on what passes join points, while active.

    ``in_model_time``: it uses the time of the model, not the clocks of the composites around it.
    """

    in_model_time: ClassVar[bool] = False

    from_ = Parameter(float, 0.0, min=0.0, unit="s", doc="active from this time on")
    until = Parameter(float, None, min=0.0, unit="s", doc="active only before this time")
    every = Parameter(float, None, above=0, unit="s", doc="period with which 'from' and 'until' repeat")
    when = PortFormulaParameter(
        None, doc="active while this expression over ports is true, such as main.state.position[0] < 20"
    )

    def __init__(self, **values: object) -> None:
        super().__init__(**values)
        if self.until is not None and self.until <= self.from_:
            raise EpicycleError(
                f"it is never active: 'until' ({self.until:g} s) must be after 'from' ({self.from_:g} s)"
            )
        if self.every is not None and (self.until is None or self.every < self.until - self.from_):
            wanted = "'until' as well" if self.until is None else "to be at least the time from 'from' to 'until'"
            raise EpicycleError(f"'every' ({self.every:g} s) needs {wanted}")

    def is_due(self, time: int) -> bool:
        """Whether ``from``, ``until`` and ``every`` let it act at this time (ns)."""
        start = to_nanoseconds(self.from_)
        if time < start or self.until is None:
            return time >= start
        length = to_nanoseconds(self.until) - start
        return (time - start if self.every is None else (time - start) % to_nanoseconds(self.every)) < length

    @property
    def is_always_active(self) -> bool:
        """Whether it acts at all times and in all states."""
        return self.from_ == 0.0 and self.until is None and self.when is None

    def reads(self) -> tuple[str, ...]:
        """Patterns of the output ports that it reads."""
        return ()

    def pass_by(self, passing: Passing, point: Point) -> None:
        """Called for what passes while the aspect is not active: passes it unchanged."""
        point.forward(passing)

    def forget(self, point: Point) -> None:
        """Called when the actor lost its state in a crash: unfinished work will never end."""
