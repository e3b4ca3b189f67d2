"""Aspect: what is woven around a model from outside, and the join points at which it acts.

The weaving contract
--------------------
The engine makes one aspect object per declaration and one ``JoinPoint`` for each port that its pointcut selects.
For every token that passes a join point it calls ``aspect.pass_token(token, point)``, which decides what goes on by
calling ``point.forward(token)`` never, once or several times, now or (with ``delay``) later, and what is noted by
calling ``point.act(...)``.  Doing exactly ``point.forward(token)`` leaves no trace.

Aspects at the same port apply in the order of their declaration, the first one outermost (nearest to the sender).
An aspect acts while it is *active*: from ``from`` until ``until`` (again every ``every``), and ``when`` a condition
over ports holds.  At other times tokens pass it untouched, and it does not learn of them.  It may look at what ports
have sent last (``PortsParameter``, ``reads``, ``point.latest``), and changes nothing but what passes where it is woven.

Each join point has a random stream of its own, keyed by the names of aspect and port: adding, removing or re-aiming
an aspect moves no stream of an actor, of another aspect, or of the same aspect at another port.  An aspect should
draw the same number of random values whatever its strength, so that runs at different strengths can be paired.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar, Protocol

from epicycle.actors import (
    Configurable,
    EpicycleError,
    Parameter,
    Stream,
    Tag,
    random_stream,
    to_nanoseconds,
    to_seconds,
)
from epicycle.actors.expression import PortFormula, PortFormulaParameter, operand, value_at

from .decoration import Decoration, decoration

Reading = tuple[str, tuple[str, ...]]  # an output port, and the fields that lead to a part of its token
Selection = Mapping[str, Sequence[str]]  # patterns, and the full paths that they select


class Weaver(Protocol):
    """What the engine offers to a join point."""

    @property
    def tag(self) -> Tag:
        """The present tag."""

    @property
    def seed(self) -> int:
        """The seed of the run."""

    def later(self, delay: int, deliver: Callable[[Any], None], token: Any) -> None:
        """Call ``deliver(token)`` after ``delay`` ns; 0 is the next microstep."""

    def hold(self, deliver: Callable[[Any], None], token: Any) -> Callable[[], None]:
        """``deliver(token)``, to be called later."""

    def latest(self, port: str) -> Any:
        """What an output port has sent last; None if it has sent nothing yet."""

    def note(self, aspect: str, port: str, event: str, token: Any) -> None:
        """Write an act of an aspect into the event log."""

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
    ``source`` is the port that tokens come from over the connection, at an output the port itself.
    """

    def __init__(
        self,
        aspect: str,
        port: str,
        weaver: Weaver,
        forward: Callable[[Any], None],
        shared: dict[Any, Any] | None = None,
        place: str = "",
        readings: Mapping[PortFormula, Sequence[Reading]] | None = None,
        source: str = "",
        selections: Mapping[str, Selection] | None = None,
    ) -> None:
        self.aspect = aspect
        self.port = port
        self.source = source or port
        self.counts: dict[str, int] = {}
        self.memory: dict[Any, Any] = {}
        self.shared: dict[Any, Any] = {} if shared is None else shared
        self._place = place or port
        self._first: JoinPoint = self
        self._weaver = weaver
        self._forward = forward
        self._readings = readings or {}
        self._selections = selections or {}

    @cached_property
    def random(self) -> Stream:
        """The random stream of the aspect at this port; many never ask for theirs."""
        if self._first is not self:
            return self._first.random
        return random_stream(self._weaver.seed, self._place, f"aspect {self.aspect}")

    def share(self, first: JoinPoint) -> None:
        """Engine: the port has another connection, on which ``first`` stands: one stream, one memory."""
        self._first, self.memory, self.counts = first, first.memory, first.counts

    @property
    def tag(self) -> Tag:
        """The present tag."""
        return self._weaver.tag

    @property
    def now(self) -> float:
        """The present time in seconds."""
        return to_seconds(self._weaver.tag.time)

    @property
    def owner(self) -> str:
        """The path of the actor or composite whose port this is."""
        return self.port.rpartition(".")[0]

    def latest(self, port: str) -> Any:
        """What an output port that the aspect ``reads`` has sent last; None if it has sent nothing yet."""
        return self._weaver.latest(port)

    def value_of(self, formula: PortFormula, **given: object) -> Any:
        """The present value of a parameter of the aspect that is an expression over ports and ``given`` names.

        None as long as one of its ports has sent nothing; raises ``EpicycleError``.
        """
        values = []
        for port, fields in self._readings.get(formula, ()):
            latest = self._weaver.latest(port)
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
            self._weaver.later(to_nanoseconds(delay), self._forward, token)

    def hold(self, token: Any) -> Callable[[], None]:
        """What lets a token pass when it is called: ``forward`` for a token that came at another time."""
        return self._weaver.hold(self._forward, token)

    def later(self, delay: float, call: Callable[[Any], None], what: Any) -> None:
        """Call ``call(what)`` after ``delay`` seconds (0 is the next microstep): for what is decided only then."""
        self._weaver.later(to_nanoseconds(delay), call, what)

    def count(self, event: str) -> None:
        """Count an event for the summary, and leave no trace in the log."""
        self.counts[event] = self.counts.get(event, 0) + 1

    def act(self, event: str, token: Any, *details: Any) -> None:
        """Count an event and write it into the event log: the token as it came, then what was done to it.

        Details are a new token or a delay in seconds; with details the logged value is a list.
        """
        self.count(event)
        self._weaver.note(self.aspect, self.port, event, [token, *details] if details else token)

    def record(self, token: Any) -> None:
        """Append a token to the signal of this join point, ``aspect@port``, among the results of the run."""
        self._weaver.record(f"{self.aspect}@{self.port}", token)

    def stop(self) -> None:
        """End the run when the present tag has been handled; the aspect is given as the reason."""
        self._weaver.stop(f"aspect {self.aspect}")


class Aspect(Configurable):
    """Base of all aspects: declare parameters in the class, write ``pass_token``.

    ``stands_at`` says which ports it can be woven around: inputs (communication), outputs (measurement), or both.
    ``events`` names what it may note, so that summaries show a zero where nothing happened; ``reports`` names the
    figures that it tells at the end of a run, with their units.  ``alters_parameters``: it may also stand at parameters
    that are numbers, which it gets as tokens whenever their actors fire.  ``in_model_time``: it goes by the time of the
    model, and not by the clocks of the composites in which it stands.
    """

    reserved: ClassVar[frozenset[str]] = frozenset({"type", "at", "enabled"})
    stands_at: ClassVar[frozenset[str]] = frozenset({"input", "output"})
    events: ClassVar[tuple[str, ...]] = ()
    reports: ClassVar[dict[str, str]] = {}
    alters_parameters: ClassVar[bool] = False
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

    def at(self, *ports: str, name: str = "") -> Decoration:
        """Let it come with actors: ``@Noise(deviation=0.1).at("output")`` before a class, or called with an instance.

        It then stands at these ports of every actor of the class, or of this one; an aspect of execution stands at the
        actor itself, without ports.  The ``name`` is that of the type unless given.  Raises ``EpicycleError``.
        """
        return decoration(self, ports, name)

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

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        """Decide what becomes of a token at a join point."""
        raise NotImplementedError(f"{type(self).__name__} has no pass_token()")

    def pass_by(self, token: Any, point: JoinPoint) -> None:
        """What becomes of a token while the aspect is not active: it goes on, untouched."""
        point.forward(token)

    def forget(self, point: JoinPoint) -> None:
        """The actor at which it stands has lost its state in a crash: what it had begun will never be over."""

    def report(self, shared: dict[Any, Any], end: int) -> dict[str, float | None]:
        """The figures that it ``reports``, from ``point.shared`` and the time (ns) at which the run ended.

        None is for a figure of which there is nothing to say, such as the mean of nothing.
        """
        return {}


class CommunicationAspect(Aspect):
    """An aspect of the way to an input port."""

    stands_at: ClassVar[frozenset[str]] = frozenset({"input"})


class ObservationAspect(Aspect, ABC):
    """An aspect that looks at what passes and never changes it: write ``observe``.

    Every token goes on at once, whatever ``observe`` does with what it sees.
    """

    @abstractmethod
    def observe(self, token: Any, point: JoinPoint) -> None:
        """Look at a token before it goes on."""

    def pass_token(self, token: Any, point: JoinPoint) -> None:
        self.observe(token, point)
        point.forward(token)


class MeasurementAspect(Aspect):
    """An aspect of what leaves an output port."""

    stands_at: ClassVar[frozenset[str]] = frozenset({"output"})
