"""The wiring of a run: the ways of tokens, from every output port to the ports behind it."""

from __future__ import annotations

from collections.abc import Callable, Container
from functools import partial
from typing import Any, TypeVar

from epicycle.actors import (
    Actor,
    Context,
    Emitter,
    EpicycleError,
    OutputPort,
    Receiver,
    declared_parameters,
    paths,
)
from epicycle.aspects import (
    ActorPoint,
    ClockAspect,
    ExecutionAspect,
    Job,
    JoinPoint,
    JoinPointAspect,
    Medium,
    Memory,
    Place,
    PortAspect,
    Target,
    aspect_stream,
)

from ...model.graph.acts import connection_place
from ...model.graph.clock import Clock
from ...model.graph.model_graph import ModelGraph
from ...model.graph.nodes import Edge
from ...model.graph.woven import WovenAspect
from ...model.text.program import describe
from ..results import EventLog, Signal
from .aspect_context import EngineContext
from .director import Director
from .directors import Directors
from .errors import ActorError, LoopError
from .execution import Execution
from .interventions import Interventions, NamedCall
from .local_time import LocalDirector
from .parameters import VaryingParameter
from .receivers import AspectCall, Call, Delayed, Deliver, Sender, WovenSender, all_of
from .refinement import Refinement
from .requests import Requests

T = TypeVar("T")
P = TypeVar("P", bound=JoinPoint)


class Wiring:
    """The effect of ``send`` at each port of a run: through delays, borders and join points to the receivers.

    ``actors`` and ``aspects`` are those of the run; the ``graph`` is not changed.  ``listeners`` get every token that
    leaves the port with their path, of an actor or a composite.  ``signals`` is where aspects record what they see,
    ``acts`` what they do if that is to have names.
    """

    def __init__(
        self,
        graph: ModelGraph,
        actors: dict[str, Actor],
        aspects: list[WovenAspect],
        director: Director,
        log: EventLog,
        listeners: dict[str, list[Deliver | Receiver]],
        signals: dict[str, Signal],
        acts: Interventions | None = None,
    ) -> None:
        self.graph = graph
        self.acts = acts
        self.actors = actors
        self.director = director
        self.log = log
        self.points: dict[str, list[JoinPoint]] = {woven.name: [] for woven in aspects}
        self._wrong_clocks = [(woven, aspect) for woven in aspects if isinstance(aspect := woven.aspect, ClockAspect)]
        self._to_begin: list[tuple[WovenAspect, ExecutionAspect, Target]] = []
        self._targets: dict[tuple[str, str], Target] = {}
        self._listeners = listeners
        self._signals = signals
        self._points_at: dict[tuple[str, str], JoinPoint] = {}
        self._memories: dict[tuple[str, str], Memory] = {}
        self._woven_at: dict[str, list[WovenAspect]] = {}
        self._woven_on: dict[tuple[str, str], list[WovenAspect]] = {}
        self._requests = {woven.name: Requests(woven) for woven in aspects if woven.model is not None}
        self._shared: dict[object, dict[Any, Any]] = {}
        self._latest: dict[str, Any] = {}  # the latest tokens of ports that aspects look at
        for woven in aspects:
            for path in (*woven.ports, *(woven.actors if isinstance(woven.aspect, ExecutionAspect) else ())):
                self._woven_at.setdefault(path, []).append(woven)
            for connection in woven.connections:
                self._woven_on.setdefault(connection, []).append(woven)
        for woven in aspects:
            if woven.model is not None:
                listeners.setdefault(woven.model.response, []).append(partial(self._answer, woven))
        for path in dict.fromkeys(path for woven in aspects for path in woven.looks_at):
            listeners.setdefault(path, []).append(partial(self._latest.__setitem__, path))
        kind: type[Directors] = type(director).composites or Directors
        self.directors = directors = kind(graph, actors, director)
        changed = {path.rpartition(".")[0] for woven in aspects for path in woven.parameters}
        self._executions = directors.executions
        for path, actor in actors.items():
            if path in self._woven_at or path in changed or directors.catches(path):
                self._executions[path] = Execution(actor, director, self._by_clock(path))
        self._outputs = [port for actor in actors.values() for port in actor.outputs.values()]
        self._emitters = self._find()
        self._vary_parameters(aspects)
        for path, execution in self._executions.items():
            if directors.catches(path):
                execution.refinement = directors.refinements[graph.refinement_of(path)]
            around = graph.director_of(path)
            if any(graph.director_of(woven.name) != around for woven in self._woven_at.get(path, ())):
                execution.resumed = directors.resumption(around)
            execution.way = self._scheduled(path, execution.execute)
            execution.forget = partial(self._forget, path)

    def _vary_parameters(self, aspects: list[WovenAspect]) -> None:
        """Let the aspects at a parameter change it before each firing of its actor."""
        standing: dict[str, list[WovenAspect]] = {}
        for woven in aspects:
            for path in woven.parameters:
                standing.setdefault(path, []).append(woven)
        for path, there in standing.items():
            owner, _, name = path.rpartition(".")
            actor = self.actors[owner]
            varying = VaryingParameter(actor, declared_parameters(type(actor))[name])
            entry: Receiver = Call(varying.set)
            for woven in reversed(there):
                entry = self._through(woven, path, path, entry)
            self._executions[owner].refresh.append(partial(entry.put, varying.nominal))

    def context_of(self, path: str) -> Context:
        """The context of an actor: its view of the run."""
        return self._executions.get(path) or self._by_clock(path)

    def _by_clock(self, path: str) -> Director | LocalDirector | Refinement:
        """The director as seen by the clock of an actor, if this is wrong."""
        clock = before = self.graph.domain_of(path).clock
        for woven, aspect in self._wrong_clocks:
            if path in woven.actors:
                try:
                    ahead, speed = aspect.error(aspect_stream(self.director.streams, woven.actors[path], woven.name))
                except Exception as error:
                    raise self._error(woven, f"error() at {path}", error) from error
                clock = Clock(clock.start + ahead, clock.rate * speed)
        if clock == before:
            return self.directors.over(path)
        base = self.directors.base(self.graph.director_of(path))
        return base if clock.is_global else LocalDirector(base, clock)

    @property
    def executed(self) -> Container[str]:
        """The actors with aspects, at themselves or at their parameters."""
        return self._executions

    def live_in(self, environment: Any) -> None:
        """Let processes live in another environment than the one that the director has made."""
        before, self.director._environment = self.director.environment, environment
        for execution in self._executions.values():
            if execution.environment is before:
                execution.environment = environment

    def open(self) -> None:
        """Let tokens be sent from now on."""
        for output, emitter in zip(self._outputs, self._emitters, strict=True):
            output.connect(emitter)

    def close(self) -> None:
        """Let no tokens be sent from now on."""
        for output in self._outputs:
            output.disconnect()

    def _find(self) -> list[Emitter]:
        channels = self.graph.channels
        for actor in self.actors.values():
            for port in actor.inputs.values():
                port.width = channels.width(port.path)
        emitters = [self._emitter(output) for output in self._outputs]
        self._open_requests()
        return emitters

    def _open_requests(self) -> None:
        """Find the ways from the request ports of aspects that are models to the actors inside."""
        ways: dict[str, Receiver] = {}
        for requests in self._requests.values():
            for place, path in requests.model.requests.items():
                if path not in ways:
                    ways[path] = all_of(self._branches(path, ()))
                boundary_port, told = self.directors.boundary_ports.get(path), partial(requests.told, place)
                onward, waits = (
                    (ways[path], False) if boundary_port is None else boundary_port.admit(place, ways[path], told)
                )
                entry = self._woven(path, path, onward)
                requests.entries[place] = (entry if waits else told(entry)).put

    def _heard(self, path: str) -> list[Receiver]:
        """The listeners to what leaves a port."""
        listeners = self._listeners.get(path, [])
        return [listener if isinstance(listener, Receiver) else Call(listener) for listener in listeners]

    def _emitter(self, port: OutputPort[Any]) -> Emitter:
        """The effect of ``port.send``."""
        port.width = len(self.graph.channels.leaving(port.path))
        everywhere = self._sender(port, None, self._branches(port.path, ()))
        # An aspect at an output comes before the send itself: what it drops has not been sent.
        if port.path not in self._woven_at:
            return everywhere
        return WovenSender(everywhere, partial(self._woven, port.path, port.path))

    def _sender(self, port: OutputPort[Any], channel: int | None, ways: list[Receiver]) -> Sender:
        writer = self.log.writer("send", port.actor.path, port.name, channel, "")
        return Sender(port, self.director, writer, all_of([*self._heard(port.path), *ways]), self)

    def along(self, port: OutputPort[Any], channel: int) -> Sender:
        """The sender over one of the channels of a port."""
        wires = self.graph.channels.leaving(port.path)[channel]
        ways = [self._way(wires[0])] if len(wires) == 1 else self._branches(port.path, (), wires)
        return self._sender(port, channel, ways)

    def _branches(
        self, path: str, edges: tuple[Edge, ...], wires: list[tuple[Edge, ...]] | None = None
    ) -> list[Receiver]:
        """The ways onward from a port, one for each connection that leaves it, or that some wires take."""
        ways = []
        for edge in self.graph.outgoing(path):
            far, taken = edge.destination, (*edges, edge)
            if wires is not None and not any(wire[: len(taken)] == taken for wire in wires):
                continue
            if paths.parent(far) in self.actors:
                onward = self._put(taken)
            else:
                onward = all_of(self._heard(far) + self._branches(far, taken, wires))
            ways.append(self._over(edge, onward, taken))
        return ways

    def _way(self, edges: tuple[Edge, ...]) -> Receiver:
        """The way along one wire alone, for tokens that are sent to one channel."""
        onward = self._put(edges)
        for edge in reversed(edges):
            onward = self._over(edge, all_of([*self._heard(edge.destination), onward]), edges)
        return onward

    def _over(self, edge: Edge, onward: Receiver, channel: tuple[Edge, ...]) -> Receiver:
        """One connection: its delay, and the aspects and the boundary port at its far end."""
        far = edge.destination
        boundary_port = self.directors.boundary_ports.get(far)
        source = far if self.graph.direction(far) == "output" else edge.source
        if boundary_port is None:
            onward = self._woven(far, source, onward)
        else:  # aspects at a port of a composite are outside of it
            lane = self.graph.channel_of(channel, edge)
            if source == far:
                onward = boundary_port.lane(lane, self._woven(far, source, onward))
            else:
                onward = self._woven(far, source, boundary_port.lane(lane, onward))
        for woven in reversed(self._woven_on.get((edge.source, far), [])):
            onward = self._through(woven, far, source, onward, connection_place(edge.source, far))
        if edge.delay is None:
            return onward
        return Delayed(self.directors.of[self.graph.director_over(edge)], edge.delay, onward)

    def _put(self, edges: tuple[Edge, ...]) -> Receiver:
        """The end of a wire, in the port of an actor."""
        owner, _, name = edges[-1].destination.rpartition(".")
        port, execution = self.actors[owner].inputs[name], self._executions.get(owner)
        stand_in = None if execution is None else execution.activation_of(port)
        return self.director.entry(port, self.graph.channels.of(edges), stand_in)

    def _woven(self, path: str, source: str, onward: Receiver) -> Receiver:
        """``onward`` preceded by the aspects at a port, the first declared outermost."""
        for woven in reversed(self._woven_at.get(path, [])):
            onward = self._through(woven, path, source, onward)
        return onward

    def _through(self, woven: WovenAspect, path: str, source: str, onward: Receiver, place: str = "") -> Receiver:
        """``onward`` preceded by one aspect at a port; ``place`` is the connection, if the aspect is at only one."""
        aspect = woven.aspect
        assert isinstance(aspect, PortAspect)
        point = self._point(JoinPoint, woven, aspect, path, onward.put, place or path, source)
        return self._named(AspectCall(aspect, aspect.pass_token, "pass_token()", point))

    def _named(self, aspect_call: AspectCall) -> Receiver:
        """The act of an aspect on what comes to a join point, with a name if acts are to have names."""
        return aspect_call if self.acts is None else NamedCall(aspect_call, self.acts, self.director)

    def _scheduled(self, path: str, onward: Callable[[Job], None]) -> Callable[[Job], None]:
        """``onward`` preceded by the aspects at an actor, the first declared outermost."""
        for woven in reversed(self._woven_at.get(path, [])):
            aspect = woven.aspect
            assert isinstance(aspect, ExecutionAspect)
            point = self._point(ActorPoint, woven, aspect, path, onward, path)
            self._join(point, woven, aspect)
            onward = self._named(AspectCall(aspect, aspect.schedule, "schedule()", point)).put
        return onward

    def _answer(self, woven: WovenAspect, request: Any) -> None:
        """Send a token onward that has come through an aspect's composite."""
        try:
            self._requests[woven.name].answer(request)
        except (ActorError, LoopError):  # of what comes behind it
            raise
        except EpicycleError as error:
            raise self._error(woven, "delivering", error) from None

    def _error(self, woven: WovenAspect, doing: str, error: Exception) -> ActorError:
        return ActorError(f"aspect {woven.name}", self.director.tag, doing, describe(error))

    def shared(self, woven: WovenAspect) -> dict[Any, Any]:
        """The state of an aspect for all its ports; shared by all declarations of a medium."""
        key: object = woven.name
        if isinstance(woven.aspect, Medium) and woven.aspect.medium is not None:
            key = (type(woven.aspect), woven.name.rpartition(".")[0], woven.aspect.medium)
        return self._shared.setdefault(key, {})

    def _point(
        self,
        kind: type[P],
        woven: WovenAspect,
        aspect: JoinPointAspect[T, P],
        path: str,
        onward: Callable[[T], None],
        place: str,
        source: str = "",
    ) -> P:
        """The join point of an aspect at a port or parameter, or at an actor."""
        is_actor, key = kind is ActorPoint, (woven.name, place)
        at = Place(woven.name, path, place, source or path, is_actor, woven.readings, woven.selections)
        local = self.director if aspect.in_model_time else self.directors.over(at.owner)
        context = EngineContext(woven.name, path, local, onward, self.director, self.log, self._latest, self._signals)
        point = kind(at, self._memories.setdefault(key, Memory(self.shared(woven))), context)
        if key not in self._points_at:  # others, at other connections, share its memory
            self.points[woven.name].append(point)
            self._points_at[key] = point
        if woven.model is not None:
            context.enter = self._requests[woven.name].add_way(point, place)
        return point

    def _join(self, point: ActorPoint, woven: WovenAspect, aspect: ExecutionAspect) -> None:
        """Add the join point of an actor to the target of the aspect."""
        aimed = woven.name, woven.actors[point.port]
        if aimed not in self._targets:
            self._targets[aimed] = Target(aimed[1], point)
            self.points[woven.name].append(self._targets[aimed])
            self._to_begin.append((woven, aspect, self._targets[aimed]))
        point.keeper, point.target = self._executions[point.port], self._targets[aimed]
        point.target.points.append(point)

    def _forget(self, path: str) -> None:
        """Notify the aspects at an actor that it has lost its state."""
        for woven in self._woven_at.get(path, ()):
            aspect, point = woven.aspect, self._points_at[woven.name, path]
            assert isinstance(aspect, ExecutionAspect)
            assert isinstance(point, ActorPoint)
            try:
                aspect.forget(point)
            except Exception as error:
                raise self._error(woven, f"forget() at {path}", error) from error

    def begin(self) -> None:
        """Start the aspects that act on their own."""
        for woven, aspect, target in self._to_begin:
            try:
                aspect.begin(target)
            except (ActorError, LoopError):
                raise
            except Exception as error:
                raise self._error(woven, f"begin() at {target.port}", error) from error
