"""Simulation: a model, wired up, woven and run."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

from epicycle.actors import (
    Actor,
    EpicycleError,
    InputPort,
    OutputPort,
    PortError,
    Tag,
    to_nanoseconds,
    to_seconds,
)
from epicycle.aspects import JoinPoint

from ..model import Hop, Model, WovenAspect, firing_order
from .director import ActorError, Director, describe
from .local import Deliver, LocalDirector, Passage
from .log import EventLog
from .results import Reduction, Results
from .signal import Signal

Emit = Callable[[Any, int | None], None]


class Simulation:
    """One run of a model, which is checked first and may not be changed between this and ``run``.

    A model can be run any number of times, each time by a Simulation of its own.

    >>> results = Simulation(load_model("collision_avoidance"), seed=7).run()
    """

    def __init__(self, model: Model, *, seed: int | None = None, keep_log: bool = False) -> None:
        model.check()
        self.model = model
        self.seed = model.seed if seed is None else seed
        if self.seed < 0:
            raise ValueError(f"a seed is a whole number from 0 up, not {self.seed}")
        self.log = EventLog(keep_log)
        self.director = Director(firing_order(model.graph), self.seed)
        self.points: dict[str, list[JoinPoint]] = {woven.name: [] for woven in model.aspects}
        self.signals = {name: Signal(name) for name in model.recorded}
        self._reductions = [(metric, Reduction(metric.take)) for metric in model.metrics]
        self._directors: dict[str, Director | LocalDirector] = {}
        self._passages: dict[str, Passage] = {}
        self._listeners: dict[str, list[Deliver]] = {}
        self._woven_at: dict[str, list[WovenAspect]] = {}
        self._emits: list[tuple[OutputPort[Any], Emit]] = []
        self._points_at: dict[tuple[str, str], JoinPoint] = {}
        self._has_run = False
        self._started = 0.0
        self._listen()
        self._wire()

    # -- wiring ---------------------------------------------------------------------------------------------------

    def _listen(self) -> None:
        """Let recorders, metrics and the stop rule hear what leaves the ports of actors and composites."""
        for name, signal in self.signals.items():
            self._hear(name, partial(self._record, signal))
        for metric, reduction in self._reductions:
            for path in metric.ports:
                self._hear(path, reduction.add)
        for path in self.model.stop_ports:
            self._hear(path, self._ask_to_stop)

    def _hear(self, path: str, listener: Deliver) -> None:
        self._listeners.setdefault(path, []).append(listener)

    def _record(self, signal: Signal, token: Any) -> None:
        signal.add(self.director.tag, token)

    def _ask_to_stop(self, token: Any) -> None:
        if token:
            self.director.stop("stop_when")

    def _wire(self) -> None:
        """Find the ways from every output port to the ports behind it, through delays and join points."""
        graph = self.model.graph
        for composite, clock in graph.clocks.items():
            self._directors[composite] = self.director if clock.is_global else LocalDirector(self.director, clock)
            for paths in graph.borders(composite):
                self._passages.update({path: Passage(path, self.director) for path in paths})
        for woven in self.model.aspects:
            for path in woven.ports:
                self._woven_at.setdefault(path, []).append(woven)
        # A port's channels are its wires, on both sides: composite ports on the way neither add nor merge any.
        channels: dict[tuple[Hop, ...], int] = {}
        for actor in graph.actors.values():
            for port in actor.inputs.values():
                wires = graph.wires_to(port)
                port.width = len(wires)
                channels.update({wire.hops: channel for channel, wire in enumerate(wires)})
        for actor in graph.actors.values():
            for output in actor.outputs.values():
                self._emits.append((output, self._emit(output, channels)))

    def _emit(self, port: OutputPort[Any], channels: dict[tuple[Hop, ...], int]) -> Emit:
        """What ``port.send`` does."""
        everywhere = _all(self._listeners.get(port.path, []) + self._branches(port.path, (), channels))
        heard = _all(self._listeners.get(port.path, []))
        ways = [self._way(wire.hops, channels[wire.hops]) for wire in self.model.graph.wires_from(port)]
        port.width = len(ways)
        log, director, path, name = self.log.add, self.director, port.actor.path, port.name

        def emit_one(token: Any, channel: int | None) -> None:
            if channel is None:
                log(director.tag, "send", path, name, None, "", token)
                everywhere(token)
                return
            if not 0 <= channel < len(ways):
                raise PortError(f"{port.path} has {len(ways)} channels from 0 on, there is no channel {channel}")
            log(director.tag, "send", path, name, channel, "", token)
            heard(token)
            ways[channel](token)

        # An aspect at an output stands before the send itself: what it drops has not been sent.
        if port.path not in self._woven_at:
            return emit_one
        entries: dict[int | None, Deliver] = {}

        def emit_woven(token: Any, channel: int | None) -> None:
            entry = entries.get(channel)
            if entry is None:
                # The channel of a send travels past the aspects in this closure, for they may forward it later.
                entry = entries[channel] = self._woven(port.path, lambda passed: emit_one(passed, channel))
            entry(token)

        return emit_woven

    def _branches(self, path: str, hops: tuple[Hop, ...], channels: dict[tuple[Hop, ...], int]) -> list[Deliver]:
        """The ways onward from a port, one for each connection that leaves it."""
        graph = self.model.graph
        ways = []
        for hop in graph.outgoing(path):
            far, taken = hop.destination, (*hops, hop)
            port = graph.ports.nodes[far]["port"]
            if isinstance(port, InputPort):
                onward = self._put(port, channels[taken])
            else:
                onward = _all(self._listeners.get(far, []) + self._branches(far, taken, channels))
            ways.append(self._over(hop, onward, taken))
        return ways

    def _way(self, hops: tuple[Hop, ...], channel: int) -> Deliver:
        """The way along one wire alone, for tokens that are sent to one channel."""
        onward = self._put(self.model.graph.ports.nodes[hops[-1].destination]["port"], channel)
        for hop in reversed(hops):
            onward = self._over(hop, _all([*self._listeners.get(hop.destination, []), onward]), hops)
        return onward

    def _over(self, hop: Hop, onward: Deliver, channel: tuple[Hop, ...]) -> Deliver:
        """One connection: its delay, and the aspects and the passage at its far end."""
        far = hop.destination
        passage = self._passages.get(far)
        # Aspects at a port of a composite stand outside of it.
        if passage is not None and self.model.graph.direction(far) == "input":
            onward = self._woven(far, passage.lane(channel, onward))
        elif passage is not None:
            onward = passage.lane(channel, self._woven(far, onward))
        else:
            onward = self._woven(far, onward)
        return onward if hop.delay is None else self._delayed(hop, hop.delay, onward)

    def _put(self, port: InputPort[Any], channel: int) -> Deliver:
        put = self.director.put
        return lambda token: put(port, channel, token)

    def _delayed(self, hop: Hop, delay: int, onward: Deliver) -> Deliver:
        later = self._directors[self.model.graph.director_over(hop)].later
        return lambda token: later(delay, onward, token)

    def _woven(self, path: str, onward: Deliver) -> Deliver:
        """``onward`` with the aspects that stand at a port before it, the first declared outermost."""
        for woven in reversed(self._woven_at.get(path, [])):
            onward = self._through(woven, path, onward)
        return onward

    def _through(self, woven: WovenAspect, path: str, onward: Deliver) -> Deliver:
        point, pass_token = self._point(woven.name, path, onward), woven.aspect.pass_token

        def through(token: Any) -> None:
            try:
                pass_token(token, point)
            except EpicycleError:
                raise
            except Exception as error:
                raise ActorError(
                    f"aspect {woven.name}", self.director.tag, f"pass_token() at {path}", describe(error)
                ) from error

        return through

    def _point(self, name: str, path: str, onward: Deliver) -> JoinPoint:
        graph = self.model.graph
        loom = Loom(self._directors[graph.director_of(graph.owner(path))], self.director, self.log)
        point = JoinPoint(name, path, loom, onward)
        first = self._points_at.setdefault((name, path), point)
        if first is point:
            self.points[name].append(point)
        else:  # another connection of the same port: one stream, one memory
            point.random, point.memory, point.counts = first.random, first.memory, first.counts
        return point

    # -- running --------------------------------------------------------------------------------------------------

    def run(self, *, until: float | None = None, progress: Callable[[float], None] | None = None) -> Results:
        """Run to the end and return what came of it; an exception in an actor is raised as ``ActorError``."""
        if self._has_run:
            raise RuntimeError("a Simulation runs once: make another one for another run")
        self._has_run = True
        stop = self.model.stop_time if until is None else to_nanoseconds(until)
        actors = list(self.model.graph.actors.values())
        director = self.director
        for actor in actors:
            actor.enter(self._directors[self.model.graph.director_of(actor.path)])
            for port in actor.inputs.values():
                port.clear()  # of what a failed run has left there
        self._started = time.perf_counter()
        begun: list[Actor] = []
        try:
            for actor in actors:
                self._call(actor, "initialize")
                begun.append(actor)
            # Ports are open only while actors fire: nothing is sent in initialize and wrapup.
            for output, emit in self._emits:
                output.connect(emit)
            stopped = director.run(stop, actors, progress)
        except ActorError as error:
            raise self._placed(error) from error.__cause__
        finally:
            for output, _ in self._emits:
                output.disconnect()
            late = self._wrap_up(begun)
        if late is not None:
            raise self._placed(late) from late.__cause__
        return self.results(stopped)

    def results(self, stopped: str) -> Results:
        """What has come of the run so far; ``stopped`` says why it is over."""
        return Results(
            model=self.model.name,
            seed=self.seed,
            parameters=dict(self.model.parameters),
            metrics={metric.name: reduction.value for metric, reduction in self._reductions},
            aspects=self._counts(),
            signals=self.signals,
            log=self.log,
            end=to_seconds(self.director.last.time),
            stopped=stopped,
            firings=self.director.firings,
            wall_time=time.perf_counter() - self._started,
            units={metric.name: metric.unit for metric in self.model.metrics},
        )

    def _wrap_up(self, actors: list[Actor]) -> ActorError | None:
        """Let every actor wrap up, whatever happened before; the first error of these is returned."""
        first = None
        for actor in actors:
            try:
                self._call(actor, "wrapup")
            except ActorError as error:
                first = first or error
        return first

    def _call(self, actor: Actor, method: str) -> None:
        try:
            getattr(actor, method)()
        except Exception as error:
            raise ActorError(actor.path, self.director.tag, f"{method}()", describe(error)) from error

    def _placed(self, error: ActorError) -> ActorError:
        """The error with the place in the model file where its actor is declared."""
        position = self.model.graph.positions.get(error.path)
        where = f"{position.file}:{position.line}:{position.column}" if position else ""
        return ActorError(error.path, error.tag, error.doing, error.reason, where)

    def _counts(self) -> dict[str, dict[str, int]]:
        """How often each event of each aspect happened, over all its ports."""
        counts: dict[str, dict[str, int]] = {}
        for woven in self.model.aspects:
            total = dict.fromkeys(woven.aspect.events, 0)
            for point in self.points[woven.name]:
                for event, number in point.counts.items():
                    total[event] = total.get(event, 0) + number
            counts[woven.name] = total
        return counts


class Loom:
    """What the engine offers to a join point: the time of the director that it stands under, and the log."""

    def __init__(self, local: Director | LocalDirector, director: Director, log: EventLog) -> None:
        self.seed = director.seed
        self.later = local.later
        self._local = local
        self._director = director
        self._log = log

    @property
    def tag(self) -> Tag:
        """The present tag."""
        return self._local.tag

    def note(self, aspect: str, port: str, event: str, token: Any) -> None:
        """Write an act of an aspect into the log."""
        actor, _, name = port.rpartition(".")
        self._log.add(self._director.tag, event, actor, name, None, aspect, token)


def _all(ways: list[Deliver]) -> Deliver:
    """One way that takes all of them."""
    if len(ways) == 1:
        return ways[0]

    def onward(token: Any) -> None:
        for way in ways:
            way(token)

    return onward
