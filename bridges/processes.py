"""SimPy programs: a generator function is an actor by naming it, and a whole program runs as it is."""

from __future__ import annotations

import inspect
import random  # noqa: TID251  # the class alone: what is drawn comes from a stream
from collections.abc import Callable, Generator, Iterable, Mapping
from pathlib import Path
from types import GeneratorType
from typing import Any, cast

import simpy
from simpy import Container, FilterStore, PreemptiveResource, PriorityResource, PriorityStore, Resource, Store
from simpy.events import NORMAL, URGENT, Event, EventPriority

from epicycle import actors
from epicycle.actors import (
    EpicycleError,
    FunctionParameter,
    InputPort,
    MappingParameter,
    OutputPort,
    Parameter,
    ParameterError,
    Stream,
    any_parameter,
    brief,
    declared_parameters,
    did_you_mean,
    texts_parameter,
)
from epicycle.runner import ActorError, Model, Simulation
from epicycle.runner.model.catalogue import given_functions

from .names import KINDS

ENV = "env"
RESOURCES: Mapping[str, type] = {
    each.__name__: each
    for each in (Resource, PriorityResource, PreemptiveResource, Container, Store, PriorityStore, FilterStore)
}
Behaviour = Callable[..., Any]


class _FunctionParameter(FunctionParameter):
    """A function of SimPy processes: given in Python, or by its name in a file that the user has named."""

    def _named(self, value: str) -> Behaviour:
        named = given_functions()
        if value in named:
            return named[value]
        known = {**named, **self.given}
        raise ParameterError(
            f"{value!r} is not a function that is known{did_you_mean(value, known)}; known: "
            f"{', '.join(sorted(known)) or 'none'}; name its file with --types FILE.py, or in Python "
            "load_model(types=[Process.knowing(function)])"
        )


def process(*, inputs: Iterable[str] = (), outputs: Iterable[str] = ()) -> Callable[[Behaviour], Behaviour]:
    """Say which arguments of a function are ports when it is an actor; in plain SimPy the function stays what it is.

    >>> @process(inputs=["arrivals"], outputs=["served"])
    ... def counter(env, arrivals, served, service=3.0): ...
    """

    def mark(function: Behaviour) -> Behaviour:
        function.ports = (tuple(inputs), tuple(outputs))  # type: ignore[attr-defined]
        return function

    return mark


class Process(actors.Process):
    """A function written for SimPy as an actor: its ``env`` is the actor's own.

    The function is a generator function, or one that starts processes by ``env.process``.  ``arguments`` gives its
    other parameters; ``{type: Store, capacity: 5}`` is a resource of SimPy's.  A parameter that is called as a port is
    that port: ``yield port.get()`` waits for the next token of an input, ``port.put(token)`` sends one.  One called
    ``random`` is a random stream of the actor with the methods of the module ``random``.

    A model file can name functions only of files that the user has named (``--types bank.py``: ``bank.customer``).
    """

    function = _FunctionParameter({}, doc="the function, such as bank.customer")
    arguments = MappingParameter(any_parameter(), {}, doc="its arguments by name, besides env and ports")
    input_ports: Any = texts_parameter(None, doc="parameters that are inputs; default: those of its decorator")
    output_ports: Any = texts_parameter(None, doc="parameters that are outputs; default: those of its decorator")

    gives = MappingParameter(
        Parameter(str, choices=tuple(KINDS)), {}, doc="type of what an output sends, by its name; default: any value"
    )

    @classmethod
    def knowing(cls, *functions: Behaviour) -> type[Process]:
        """This actor class, for models that may also name these functions, as ``module.name`` or ``name``."""
        before: _FunctionParameter = declared_parameters(cls)["function"]  # type: ignore[assignment]
        given = dict(before.given)
        for each in functions:
            given[each.__name__] = given[f"{each.__module__}.{each.__qualname__}"] = each
        parameter = _FunctionParameter(given, doc=before.doc)
        return type(cls.__name__, (cls,), {"function": parameter, "__doc__": cls.__doc__, "__module__": cls.__module__})

    def _named(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """The names of inputs and of outputs."""
        inputs, outputs = getattr(self.function, "ports", ((), ()))
        return (
            inputs if self.input_ports is None else self.input_ports,
            outputs if self.output_ports is None else self.output_ports,
        )

    def own_ports(self) -> dict[str, InputPort[Any] | OutputPort[Any]]:
        inputs, outputs = self._named()
        found: dict[str, InputPort[Any] | OutputPort[Any]] = {name: InputPort() for name in inputs}
        for name in outputs:
            if name in found:
                raise ParameterError(f"{name} is both an input and an output")
            found[name] = OutputPort(KINDS[self.gives.get(name, "any value")], depends_on=())
        for name in self.gives:
            if name not in outputs:
                raise ParameterError(f"gives: {name!r} is not an output{did_you_mean(name, outputs)}")
        return found

    def check(self) -> None:
        name = _name(self.function)
        try:
            parameters = inspect.signature(self.function).parameters
        except (TypeError, ValueError):
            raise ParameterError(f"function: {name} does not declare its parameters") from None
        if ENV not in parameters:
            raise ParameterError(
                f"function: {name} has no parameter {ENV!r}; it has: {', '.join(parameters) or 'none'}"
            )
        takes_any = any(each.kind is each.VAR_KEYWORD for each in parameters.values())
        taken = {ENV, *self.inputs, *self.outputs}
        for key in (*self.inputs, *self.outputs, *self.arguments):
            if key not in parameters and not takes_any:
                others = [each for each in parameters if each not in taken or each == key]
                raise ParameterError(f"function: {name} has no parameter {key!r}{did_you_mean(key, others)}")
        for key in self.arguments:
            if key in taken:
                raise ParameterError(f"arguments.{key}: {key!r} is {'the environment' if key == ENV else 'a port'}")
        missing = [
            key
            for key, each in parameters.items()
            if each.default is each.empty
            and each.kind in (each.POSITIONAL_OR_KEYWORD, each.KEYWORD_ONLY)
            and key not in {*taken, *self.arguments, "random"}
        ]
        if missing:
            raise ParameterError(f"function: {name} needs a value for {', '.join(missing)}: give it in 'arguments'")
        self._draws = "random" in parameters and "random" not in {*taken, *self.arguments}
        for key, value in self.arguments.items():
            made(f"arguments.{key}", value, simpy.Environment())

    def beginning(self) -> Event:
        # Where SimPy itself would begin, before the first tag.
        event = Event(self.environment)
        event._ok, event._value = True, None
        event.callbacks = None  # type: ignore[assignment]
        return event

    def run(self) -> Generator[Event, Any, None]:
        given = {key: made(f"arguments.{key}", value, self.environment) for key, value in self.arguments.items()}
        given |= {name: Inlet(self, port) for name, port in self.inputs.items()}
        given |= {name: Outlet(self, port) for name, port in self.outputs.items()}
        if self._draws:
            given["random"] = Random(self.random)
        result = self.function(**{ENV: self.environment}, **given)
        if inspect.isgenerator(result):
            yield from _checked(cast("GeneratorType[Any, Any, Any]", result), _name(self.function))
        elif isinstance(result, Event):
            yield result


def _name(function: Behaviour) -> str:
    return getattr(function, "__name__", repr(function))


def _checked(behaviour: GeneratorType[Any, Any, Any], name: str) -> Generator[Event, Any, None]:
    """A generator, as it is as long as it yields events."""
    act, given = behaviour.send, None
    while True:
        try:
            event = act(given)
        except StopIteration:
            return
        if not isinstance(event, Event):
            frame, file = behaviour.gi_frame, Path(behaviour.gi_code.co_filename).name
            where = f"{file}:{frame.f_lineno}" if frame is not None else file
            behaviour.close()
            raise EpicycleError(f"{name} yields {brief(event)} at {where}, which is not an event")
        try:
            act, given = behaviour.send, (yield event)
        except BaseException as error:  # an interrupt, the failure of the event, or the end of the run
            act, given = behaviour.throw, error


def made(name: str, value: Any, env: simpy.Environment) -> Any:
    """The value of an argument: a resource of SimPy's where a mapping names its type."""
    if not isinstance(value, Mapping) or "type" not in value:
        return value
    kind, options = str(value["type"]), {key: each for key, each in value.items() if key != "type"}
    if kind not in RESOURCES:
        raise ParameterError(
            f"{name}: SimPy has no resource {kind!r}{did_you_mean(kind, RESOURCES)}; it has: {', '.join(RESOURCES)}"
        )
    try:
        return RESOURCES[kind](env, **options)
    except (TypeError, ValueError) as error:
        raise ParameterError(f"{name}: {kind}: {error}") from None


class Inlet:
    """An input port as a process sees it: a store to get from."""

    def __init__(self, actor: actors.Process, port: InputPort[Any]) -> None:
        self._actor, self._port = actor, port

    @property
    def items(self) -> list[Any]:
        """Tokens that have arrived and nobody has got."""
        return self._actor.unread(self._port)

    def get(self) -> Event:
        """An event whose value is the next token."""
        return self._actor.read(self._port)


class Outlet:
    """An output port as a process sees it: a store to put into, which is never full."""

    def __init__(self, actor: actors.Process, port: OutputPort[Any]) -> None:
        self._actor, self._port = actor, port

    def put(self, item: Any) -> Event:
        """Send a token."""
        self._port.send(item)
        return Event(self._actor.environment).succeed()


class Random(random.Random):
    """A random stream with the methods of the module ``random``; the laws that need logarithms are the stream's."""

    def __new__(cls, stream: Stream) -> Random:
        return super().__new__(cls)

    def __init__(self, stream: Stream) -> None:
        self._stream = stream
        super().__init__()

    def seed(self, a: object = None, version: int = 2) -> None:
        """Only the seed of the run decides; the stream is not moved."""

    def random(self) -> float:
        return float(self._stream.random())

    def getrandbits(self, k: int) -> int:
        return int(self._stream.below(1 << k)) if k else 0

    def expovariate(self, lambd: float = 1.0) -> float:
        return float(self._stream.exponential(1.0 / lambd))

    def gauss(self, mu: float = 0.0, sigma: float = 1.0) -> float:
        return float(self._stream.normal(mu, sigma))

    normalvariate = gauss

    def lognormvariate(self, mu: float = 0.0, sigma: float = 1.0) -> float:
        return float(self._stream.lognormal(mu, sigma))

    def gammavariate(self, alpha: float, beta: float) -> float:
        return float(self._stream.gamma(alpha, beta))

    def triangular(self, low: float = 0.0, high: float = 1.0, mode: float | None = None) -> float:
        return float(self._stream.triangular(low, (low + high) / 2 if mode is None else mode, high))

    def weibullvariate(self, alpha: float, beta: float) -> float:
        return float(alpha * self._stream.weibull(beta))


def _defuse(event: Event) -> None:
    if not event.ok:
        event.defused = True


class Environment(actors.Environment):
    """``simpy.Environment`` for a program that stays as it is: Epicycle's director lets its time pass.

    Events happen at whole nanoseconds, while ``now`` is the sum of delays that SimPy would show, a whole number if all
    of them are.  ``simulation`` is the run, for what plain SimPy does not have.
    """

    def __init__(self, initial_time: float = 0, *, seed: int = 1) -> None:
        if initial_time:
            raise ValueError(f"initial_time: a run begins at 0 s, not at {initial_time:g} s")
        self.simulation = Simulation(Model("program", seed=seed))
        self._shown: float = 0
        super().__init__(self.simulation.director)

    @property
    def now(self) -> float:
        """The present time (s)."""
        return self._shown

    def schedule(self, event: Event, priority: EventPriority = NORMAL, delay: float = 0) -> None:
        """Let an event happen after ``delay`` s; raises ``ValueError`` for what is not a time."""
        time = self._shown + delay

        def show(_: Event) -> None:
            self._shown = time

        event.callbacks.insert(0, show)
        super().schedule(event, priority, delay)

    def run(self, until: float | Event | None = None) -> Any:  # type: ignore[override]
        """As ``simpy.Environment.run``: to the end, to a time (s), or until an event has happened."""
        if until is None:
            self._go_on([])
            return None
        if isinstance(until, Event):
            if until.processed:
                return until.value
            event = until
        else:
            if until <= self._shown:
                raise ValueError(f"until ({until}) must be greater than the current simulation time")
            event = Event(self)
            event._ok, event._value = True, None
            self.schedule(event, URGENT, until - self._shown)
        happened: list[Event] = []
        event.callbacks += [happened.append, _defuse]
        self._go_on(happened)
        if not happened:
            raise RuntimeError(f'No scheduled events left but "until" event was not triggered: {event}')
        if not event.ok:
            failure: Any = event.value
            raise failure
        return event.value

    def _go_on(self, happened: list[Event]) -> None:
        try:
            while not happened and self.simulation.step():
                pass
        except ActorError as error:
            raise (error if error.__cause__ is None else error.__cause__) from None  # as SimPy does

    def step(self) -> None:  # type: ignore[override]
        """Let the next event happen."""
        if not self.simulation.step():
            raise simpy.core.EmptySchedule
