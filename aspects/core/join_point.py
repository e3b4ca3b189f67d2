"""JoinPoint: a place where an aspect stands; and what the aspects that act at such places have in common.

The weaving contract
--------------------
There are three kinds, by what passes an aspect: tokens at ports (``PortAspect``), firings of actors
(``ExecutionAspect``), and the time that actors see (``ClockAspect``).  The engine makes one aspect object per
declaration and one ``JoinPoint`` for each port or actor that its pointcut selects.  For every token or firing that
passes a join point it calls ``pass_token`` or ``schedule``, which decides what goes on by calling ``point.forward``
never, once or several times, now or (with ``delay``) later, and what is noted by calling ``point.act(...)``.  Doing
exactly ``point.forward(token)`` leaves no trace.

Aspects at the same port apply in the order of their declaration, the first one outermost (nearest to the sender).
An aspect acts while it is *active*: from ``from`` until ``until`` (again every ``every``), and ``when`` a condition
over ports holds.  At other times what passes goes on untouched, and the aspect does not learn of it.  It may look at
what ports have sent last (``PortsParameter``, ``reads``, ``point.latest``), and changes nothing but what passes it.

Each join point has a random stream of its own, keyed by the names of aspect and place: adding, removing or re-aiming
an aspect moves no stream of an actor, of another aspect, or of the same aspect at another place.  An aspect should
draw the same number of random values whatever its strength, so that runs at different strengths can be paired.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar, Generic, Protocol, TypeVar

from epicycle.actors import EpicycleError, Parameter, Stream, Streams, Tag, to_nanoseconds, to_seconds
from epicycle.actors.expression import PortFormula, PortFormulaParameter, operand, value_at

from .aspect import Aspect

TOKEN = "token"  # what expressions over ports call the token that passes
Reading = tuple[str, tuple[str, ...]]  # an output port, and the fields that lead to a part of its token
Selection = Mapping[str, Sequence[str]]  # patterns, and the full paths that they select


class AspectContext(Protocol):
    """What the engine offers to a join point."""

    @property
    def tag(self) -> Tag:
        """The present tag."""

    @property
    def streams(self) -> Streams:
        """The random streams of the run."""

    def later(self, delay: int, deliver: Callable[[Any], None], token: Any) -> None:
        """Call ``deliver(token)`` after ``delay`` ns; 0 is the next microstep."""

    def hold(self, deliver: Callable[[Any], None], token: Any) -> Callable[[], None]:
        """``deliver(token)``, to be called later."""

    def latest(self, port: str) -> Any:
        """What an output port has sent last; None if it has sent nothing yet."""

    def note(self, aspect: str, owner: str, port: str, event: str, token: Any) -> None:
        """Write an act of an aspect into the event log; ``port`` is a name, empty for an act at an actor."""

    def record(self, signal: str, token: Any) -> None:
        """Append a token to a signal among the results of the run."""

    def stop(self, reason: str) -> None:
        """End the run when the present tag has been handled; the first who asks gives the reason."""


class JoinPoint:
    """One port that an aspect stands at.

    ``counts`` holds how often each event happened here.  ``memory`` belongs to the aspect, for what it must remember
    about this port between tokens; ``shared`` is one for all its ports.  ``place`` is the connection, for an aspect
    that stands on one connection to the port alone.  ``readings`` are what the aspect's expressions over ports ask for,
    ``selections`` what its parameters with patterns select.
    ``source`` is the port that tokens come from over the connection, at an output the port itself; ``owner`` the actor
    or composite whose port it is.  ``enter`` lets a token into the composite, for an aspect that is a model.
    """

    def __init__(
        self,
        aspect: str,
        port: str,
        context: AspectContext,
        forward: Callable[[Any], None],
        shared: dict[Any, Any] | None = None,
        place: str = "",
        readings: Mapping[PortFormula, Sequence[Reading]] | None = None,
        source: str = "",
        selections: Mapping[str, Selection] | None = None,
    ) -> None:
        self.aspect = aspect
        self.port = port
        self.owner, self._name = self._parts(port)
        self.source = source or port
        self.enter = forward
        self.counts: dict[str, int] = {}
        self.memory: dict[Any, Any] = {}
        self.shared: dict[Any, Any] = {} if shared is None else shared
        self._place = place or port
        self._first: JoinPoint = self
        self._context = context
        self._forward = forward
        self._readings = readings or {}
        self._selections = selections or {}

    @staticmethod
    def _parts(port: str) -> tuple[str, str]:
        """The path of the actor or composite whose port this is, and the port's name."""
        owner, _, name = port.rpartition(".")
        return owner, name

    @cached_property
    def random(self) -> Stream:
        """The random stream of the aspect at this port; many never ask for theirs."""
        if self._first is not self:
            return self._first.random
        return aspect_stream(self._context.streams, self._place, self.aspect)

    def is_at(self, other: JoinPoint) -> bool:
        """Whether it is the same place of the same aspect: a single token may have a join point of its own."""
        return self._place == other._place and self.aspect == other.aspect

    def share(self, first: JoinPoint) -> None:
        """Engine: the port has another connection, on which ``first`` stands: one stream, one memory."""
        self._first, self.memory, self.counts = first, first.memory, first.counts

    @property
    def tag(self) -> Tag:
        """The present tag."""
        return self._context.tag

    @property
    def now(self) -> float:
        """The present time in seconds."""
        return to_seconds(self._context.tag.time)

    def latest(self, port: str) -> Any:
        """What an output port that the aspect ``reads`` has sent last; None if it has sent nothing yet."""
        return self._context.latest(port)

    def value_of(self, formula: PortFormula, **given: object) -> Any:
        """The present value of a parameter of the aspect that is an expression over ports and ``given`` names.

        None as long as one of its ports has sent nothing; raises ``EpicycleError``.
        """
        values = []
        for port, fields in self._readings.get(formula, ()):
            latest = self._context.latest(port)
            if latest is None:
                return None
            values.append(operand(value_at(latest, fields)))
        return formula(values, **given)

    def selected(self, parameter: str) -> Selection:
        """The full paths that each pattern in a ``SelectionParameter`` of the aspect selects."""
        return self._selections.get(parameter, {})

    def forward(self, token: Any, delay: float | None = None) -> None:
        """Let a token pass, at once or after ``delay`` seconds (0 is the next microstep)."""
        if delay is None:
            self._forward(token)
        else:
            self._context.later(to_nanoseconds(delay), self._forward, token)

    def hold(self, token: Any) -> Callable[[], None]:
        """What lets a token pass when it is called: ``forward`` for a token that came at another time."""
        return self._context.hold(self._forward, token)

    def later(self, delay: float, call: Callable[[Any], None], what: Any) -> None:
        """Call ``call(what)`` after ``delay`` seconds (0 is the next microstep): for what is decided only then."""
        self._context.later(to_nanoseconds(delay), call, what)

    def count(self, event: str) -> None:
        """Count an event for the summary, and leave no trace in the log."""
        self.counts[event] = self.counts.get(event, 0) + 1

    def act(self, event: str, token: Any, *details: Any) -> None:
        """Count an event and write it into the event log: the token as it came, then what was done to it.

        Details are a new token or a delay in seconds; with details the logged value is a list.
        """
        self.count(event)
        self._context.note(self.aspect, self.owner, self._name, event, [token, *details] if details else token)

    def record(self, token: Any) -> None:
        """Append a token to the signal of this join point, ``aspect@port``, among the results of the run."""
        self._context.record(f"{self.aspect}@{self.port}", token)

    def stop(self) -> None:
        """End the run when the present tag has been handled; the aspect is given as the reason."""
        self._context.stop(f"aspect {self.aspect}")


def aspect_stream(streams: Streams, place: str, aspect: str) -> Stream:
    """The random stream of an aspect at a place: a port, a connection, an actor."""
    return streams.of(place, f"aspect {aspect}")


Passing = TypeVar("Passing")  # a token, or a firing
Point = TypeVar("Point", bound=JoinPoint)


class JoinPointAspect(Aspect, Generic[Passing, Point]):
    """What aspects of ports and of execution have in common: they act on what passes join points, while active.

    ``in_model_time``: it goes by the time of the model, and not by the clocks of the composites in which it stands.
    """

    in_model_time: ClassVar[bool] = False

    from_ = Parameter(float, 0.0, min=0.0, unit="s", doc="active from this time on")
    until: Parameter[float | None] = Parameter(float, None, min=0.0, unit="s", doc="active before this time alone")
    every: Parameter[float | None] = Parameter(
        float, None, above=0, unit="s", doc="active again after this time, and again: a period of on and off"
    )
    when = PortFormulaParameter(
        None, doc="active while this expression over ports is true, such as main.state.position[0] < 20"
    )

    def __init__(self, **values: object) -> None:
        super().__init__(**values)
        if self.until is not None and self.until <= self.from_:
            raise EpicycleError(f"it is never active: until {self.until:g} s is not after from {self.from_:g} s")
        if self.every is not None and (self.until is None or self.every < self.until - self.from_):
            wanted = "a time 'until' as well" if self.until is None else "at least the time from 'from' to 'until'"
            raise EpicycleError(f"every {self.every:g} s needs {wanted}")

    def is_due(self, time: int) -> bool:
        """Whether ``from``, ``until`` and ``every`` let it act at this time (ns)."""
        start = to_nanoseconds(self.from_)
        if time < start or self.until is None:
            return time >= start
        length = to_nanoseconds(self.until) - start
        return (time - start if self.every is None else (time - start) % to_nanoseconds(self.every)) < length

    @property
    def is_always_active(self) -> bool:
        """Whether there is no time and no state in which it does not act."""
        return self.from_ == 0.0 and self.until is None and self.when is None

    def reads(self) -> tuple[str, ...]:
        """Patterns of the output ports that it looks at."""
        return ()

    def pass_by(self, passing: Passing, point: Point) -> None:
        """What becomes of what passes while the aspect is not active: it goes on, untouched."""
        point.forward(passing)

    def forget(self, point: Point) -> None:
        """The actor at which it stands has lost its state in a crash: what it had begun will never be over."""
