"""Actor: a node of a model graph, and the contract between it and the director.

The firing contract
-------------------
A director calls ``initialize``, then ``fire`` any number of times, then ``wrapup`` of every actor.

``initialize`` is called once, before time starts.  An actor sets up its state here and may request wake-ups: one
requested for the present time comes at the first tag of the run, (start, 1).  Ports hold nothing yet, and nothing may
be sent.

``fire`` is called at a tag at which a token is present at an input or a wake-up is due.  When it is called, every
actor upstream (along connections without delay, and outputs that depend on inputs within the same tag) has finished
with this tag: all tokens of the tag are there, and an absent token will not come.  So it is called once per tag; only
an actor with an output that does not depend on some input within the tag is called separately for the tokens of such
inputs.  In ``fire`` an actor may read its inputs (``port.present``, ``port.value``, ``port.tokens``), send any number
of tokens, change its state and request wake-ups.  Tokens that it does not read are dropped when it returns.  A token
that it sends is received within the same tag unless the connection has a delay.

``wake_in(seconds)`` and ``wake_at(seconds)`` request a later firing: a wake-up for the present time comes at the same
time, one microstep on; one in the future at microstep 1.  A request for the past means now.  A ``Wake`` can be
cancelled; two requests for one tag give one firing.

``wrapup`` is called once after the last tag, also when the run failed.  Nothing may be sent.

An actor keeps all its state in itself, draws random numbers from ``random`` alone, and never looks at another actor:
so it cannot know which aspects are attached to it, and a run is a function of model and seed.  Each run has its own
actors, copies of those in the model, and a snapshot of a run has copies of these.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Protocol, Self, cast
from weakref import WeakKeyDictionary

from .errors import ParameterError
from .parameter import Configurable
from .port_parameter import ParameterPort, PortParameter
from .ports import InputPort, OutputPort, PortError
from .random import Stream, Streams
from .tag import Tag, Wake, to_nanoseconds, to_seconds


class Context(Protocol):
    """The interface that the engine offers to an actor of a running model."""

    @property
    def tag(self) -> Tag:
        """The present tag."""

    @property
    def time(self) -> int:
        """Its time (ns)."""

    @property
    def seed(self) -> int:
        """The seed of the run."""

    @property
    def streams(self) -> Streams:
        """Its random streams."""

    @property
    def environment(self) -> Any:
        """The SimPy environment; its clock and delays are in seconds."""

    def wake(self, actor: Actor, time: int) -> Wake:
        """Fire ``actor`` at ``time`` (ns)."""

    def stop(self, reason: str) -> None:
        """End the run when the present tag has been handled; ``reason`` says why it ended."""


class _NoContext:
    """The context of an actor that is not part of a run."""

    def __init__(self, actor: Actor) -> None:
        self._actor = actor

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):  # Python itself reads these, for example to copy
            raise AttributeError(name)
        raise RuntimeError(f"{self._actor.path} is not part of a running model")


class _SourceByPorts:
    """``Actor.is_source`` of a class that does not declare it: an actor without inputs can only be woken by itself."""

    def __get__(self, instance: object, owner: type[Actor]) -> bool:
        ports = declared_ports(owner).values()
        takes_tokens = any(isinstance(port, InputPort) and not isinstance(port, ParameterPort) for port in ports)
        return not takes_tokens and not has_own_ports(owner)


class Actor(Configurable):
    """Base of all actors: declare ``InputPort``, ``OutputPort`` and ``Parameter`` in the class, write ``fire``.

    >>> class Gain(Actor):
    ...     input = InputPort(float)
    ...     output = OutputPort(float)
    ...     factor = Parameter(float, 1.0, doc="what each token is multiplied by")
    ...
    ...     def fire(self) -> None:
    ...         for token in self.input.tokens:
    ...             self.output.send(self.factor * token)
    """

    # Whether the actor drives itself with wake-ups; if not, an instance without any input never fires.  The default is
    # true for classes without inputs other than parameters; a class with inputs that starts by itself sets True.
    is_source: ClassVar[bool] = cast(bool, _SourceByPorts())

    # Outputs of which every token says that something has happened, whatever its value.
    event_outputs: Collection[str] = ()

    @property
    def is_endless(self) -> bool:
        """Whether it is known to drive itself for ever, so that something else must end a run."""
        return False

    _streams: dict[str, Stream] | None = None  # by purpose, once there is one

    def __init__(self, path: str, **parameters: object) -> None:
        self.path = path
        self.is_part = False  # of a model
        self.context: Context = _NoContext(self)  # the run that the actor is part of
        self.inputs: dict[str, InputPort[Any]] = {}
        self.outputs: dict[str, OutputPort[Any]] = {}
        for name, port in declared_ports(type(self)).items():
            bound = port.bind(self)
            if not isinstance(bound, ParameterPort):  # the name reads as the parameter's value
                setattr(self, name, bound)
            if isinstance(bound, InputPort):
                self.inputs[name] = bound
            else:
                self.outputs[name] = bound
        try:
            self._configure(parameters)
        except ParameterError as error:
            raise ParameterError(f"{path}: {error}") from None
        for name, port in self.own_ports().items():
            self._add_own(name, port)
        self.check()

    def own_ports(self) -> dict[str, InputPort[Any] | OutputPort[Any]]:
        """Ports of this instance in addition to those of its class, by name; they follow from its parameters.

        They are in ``inputs`` and ``outputs`` and not attributes, so they may have any name.
        """
        return {}

    def _add_own(self, name: str, port: InputPort[Any] | OutputPort[Any]) -> None:
        if not name.isidentifier() or not name.isascii():
            raise PortError(f"{name!r} cannot be the name of a port: use letters, digits and _, and no digit first")
        if name in self.inputs or name in self.outputs:
            raise PortError(f"there would be two ports named {name!r}")
        port.name = name
        bound = port.bind(self)
        if isinstance(bound, InputPort):
            self.inputs[name] = bound
        else:
            self.outputs[name] = bound

    def twin(self, known: dict[int, Any]) -> Self:
        """Engine: begin a copy that is not part of a run, with its ports.  ``known`` receives the copies, by id."""
        made = object.__new__(type(self))
        made.path = self.path
        for side in (self.inputs, self.outputs):
            known[id(side)] = twins = {}
            for name, port in side.items():
                known[id(port)] = twins[name] = port.twin(made)
        known[id(self.context)] = _NoContext(made)
        return made

    def move(self, path: str) -> None:
        """Engine: set the full path in the model that the actor is added to."""
        self.path = path
        for port in (*self.inputs.values(), *self.outputs.values()):
            port.path = f"{path}.{port.name}"

    def initialize(self) -> None:
        """Called once before the first tag."""

    def fire(self) -> None:
        """Called at each tag with a token or a wake-up for the actor; see the firing contract."""
        raise NotImplementedError(f"{type(self).__name__} has no fire()")

    def wrapup(self) -> None:
        """Called once after the last tag."""

    def restart(self) -> None:
        """Called when the actor starts again in the middle of a run, after a crash that cost it its state.

        Its wake-ups have been cancelled by then, and its random streams continue.  The default is to start as before
        the first tag, by ``initialize``; an actor with wake-ups at fixed times of the run must skip those that are
        over.
        """
        for port in self.inputs.values():
            if isinstance(port, ParameterPort):
                port.reset()
        self.initialize()

    def halt(self) -> None:
        """Called when a crash costs the actor its state: nothing that it has begun may continue."""

    def enter(self, context: Context) -> None:
        """Engine: the actor becomes part of a run."""
        self.context = context
        self._streams = None
        for port in self.inputs.values():
            if isinstance(port, ParameterPort):
                port.reset()

    @property
    def tag(self) -> Tag:
        """The present tag."""
        return self.context.tag

    @property
    def now(self) -> float:
        """The present time in seconds."""
        return to_seconds(self.context.time)

    @property
    def random(self) -> Stream:
        """The actor's random stream."""
        return self.random_stream("")

    def random_stream(self, purpose: str) -> Stream:
        """A random stream of the actor for one purpose, independent of all others."""
        if self._streams is None:
            self._streams = {}
        if purpose not in self._streams:
            self._streams[purpose] = self.context.streams.of(self.path, purpose)
        return self._streams[purpose]

    def wake_in(self, delay: float) -> Wake:
        """Request a firing after ``delay`` seconds."""
        return self.context.wake(self, self.context.time + to_nanoseconds(delay))

    def wake_at(self, time: float) -> Wake:
        """Request a firing at ``time`` seconds."""
        return self.context.wake(self, to_nanoseconds(time))


_declared: WeakKeyDictionary[type, Mapping[str, InputPort[Any] | OutputPort[Any]]] = WeakKeyDictionary()


def has_own_ports(cls: type[Actor]) -> bool:
    """Whether instances of an actor class may have ports that the class does not declare."""
    return cls.own_ports is not Actor.own_ports


def declared_ports(cls: type) -> Mapping[str, InputPort[Any] | OutputPort[Any]]:
    """The ports of an actor class by name, those of its bases first."""
    if (known := _declared.get(cls)) is not None:  # called for every instance of a class
        return known
    found: dict[str, InputPort[Any] | OutputPort[Any]] = {}
    for base in reversed(cls.__mro__):
        for name, value in vars(base).items():
            if isinstance(value, (InputPort, OutputPort)):
                found[name] = value
            elif isinstance(value, PortParameter):
                found[name] = value.port
    inputs = [name for name, port in found.items() if isinstance(port, InputPort)]
    for name, port in found.items():
        apart = port.terms.independent_of
        if apart:
            if unknown := [each for each in apart if each not in inputs]:
                raise TypeError(f"{cls.__name__}.{name} is independent of {unknown[0]!r}, which is no input")
            found[name] = port.twin(None)
            found[name].change("depends_on", tuple(each for each in inputs if each not in apart))
    return _declared.setdefault(cls, MappingProxyType(found))
