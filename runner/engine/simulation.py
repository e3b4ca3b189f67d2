"""Simulation: a model, wired up, woven and run."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from epicycle.actors import Actor, EpicycleError, InputPort, OutputPort, Tag, to_seconds
from epicycle.aspects import JoinPoint

from ..model import Hop, Model
from .director import ActorError, Director, describe
from .log import EventLog
from .results import Reduction, Results, Signal

Deliver = Callable[[Any], None]


class Simulation:
    """One run of a model.

    >>> results = Simulation(load_model("collision_avoidance"), seed=7).run()
    """

    def __init__(self, model: Model, *, seed: int | None = None, keep_log: bool = False) -> None:
        self.model = model
        self.seed = model.seed if seed is None else seed
        self.log = EventLog(keep_log)
        self.director = Director(model.graph.firing_order(), self.seed)
        self.points: dict[str, list[JoinPoint]] = {woven.name: [] for woven in model.aspects}
        self.signals = {name: Signal(name) for name in model.record}
        self._listeners: dict[str, list[Callable[[Any], None]]] = {}
        self._stop_asked = False
        self._wall_time = 0.0
        self._reductions = [(metric, Reduction(metric.take)) for metric in model.metrics]
        self._listen()
        self._wire()

    # -- what aspects may ask, beside the director ----------------------------------------------------------------

    @property
    def tag(self) -> Tag:
        """The present tag."""
        return self.director.tag

    def later(self, delay: int, deliver: Deliver, token: Any) -> None:
        """Call ``deliver(token)`` after ``delay`` ns."""
        self.director.later(delay, deliver, token)

    def note(self, aspect: str, port: str, event: str, token: Any) -> None:
        """Write an act of an aspect into the log."""
        actor, _, name = port.rpartition(".")
        self.log.add(self.director.tag, event, actor, name, None, aspect, token)

    # -- wiring ---------------------------------------------------------------------------------------------------

    def _listen(self) -> None:
        """Let recorders, metrics and the stop rule hear what ports send."""
        for name, port in self.model.record.items():
            signal = self.signals[name]
            self._hear(port, lambda token, signal=signal: signal.add(self.director.tag, token))
        for metric, reduction in self._reductions:
            for port in metric.ports:
                self._hear(port, reduction.add)
        for port in self.model.stop_when:
            self._hear(port, self._ask_to_stop)

    def _hear(self, port: OutputPort[Any], listener: Callable[[Any], None]) -> None:
        self._listeners.setdefault(port.path, []).append(listener)

    def _ask_to_stop(self, token: Any) -> None:
        if token:
            self._stop_asked = True

    def _wire(self) -> None:
        """Give every output port its way to the ports behind it, through delays and join points."""
        graph = self.model.graph
        # A port's channels are its wires in declaration order; the same order on both sides of a composite port.
        channels: dict[tuple[Hop, ...], int] = {}
        for actor in graph.actors.values():
            for port in actor.inputs.values():
                wires = graph.wires_to(port)
                port.width = len(wires)
                channels.update({wire.hops: channel for channel, wire in enumerate(wires)})
        for actor in graph.actors.values():
            for output in actor.outputs.values():
                self._connect(output, channels)

    def _connect(self, port: OutputPort[Any], channels: dict[tuple[Hop, ...], int]) -> None:
        ways = self._branches(port.path, (), channels)
        port.width = len(ways)
        log, director, path, name = self.log.add, self.director, port.actor.path, port.name
        listeners = self._listeners.get(port.path, [])

        def emit_one(token: Any, channel: int | None) -> None:
            log(director.tag, "send", path, name, channel, "", token)
            for listener in listeners:
                listener(token)
            if channel is None:
                for way in ways:
                    way(token)
            else:
                ways[channel](token)

        # An aspect at an output stands before the send itself: what it drops has not been sent.
        points = [woven for woven in self.model.aspects if port.path in woven.ports]
        if not points:
            port.connect(emit_one)
            return
        # The channel of a send travels past the aspects in this cell, for a token may be forwarded later.
        entries: dict[int | None, Deliver] = {}

        def emit_woven(token: Any, channel: int | None) -> None:
            entry = entries.get(channel)
            if entry is None:
                entry = entries[channel] = self._woven(port.path, lambda passed: emit_one(passed, channel))
            entry(token)

        port.connect(emit_woven)

    def _branches(
        self, path: str, hops: tuple[Hop, ...], channels: dict[tuple[Hop, ...], int]
    ) -> list[Deliver]:
        """The ways onward from a port, one for each connection that leaves it."""
        graph = self.model.graph
        ways = []
        for hop in graph.outgoing(path):
            far, taken = hop.destination, (*hops, hop)
            port = graph.ports.nodes[far]["port"]
            if isinstance(port, InputPort):
                onward = self._put(port, channels[taken])
            else:
                onward = _all(self._branches(far, taken, channels))
            onward = self._woven(far, onward)
            if hop.delay is not None:
                onward = self._delayed(hop.delay, onward)
            ways.append(onward)
        return ways

    def _put(self, port: InputPort[Any], channel: int) -> Deliver:
        put = self.director.put
        return lambda token: put(port, channel, token)

    def _delayed(self, delay: int, onward: Deliver) -> Deliver:
        later = self.director.later
        return lambda token: later(delay, onward, token)

    def _woven(self, path: str, onward: Deliver) -> Deliver:
        """``onward`` with the aspects that stand at a port before it, the first declared outermost."""
        for woven in reversed(self.model.aspects):
            if path not in woven.ports:
                continue
            onward = self._through(woven.name, woven.aspect.pass_token, path, onward)
        return onward

    def _through(self, name: str, pass_token: Callable[[Any, JoinPoint], None], path: str, onward: Deliver) -> Deliver:
        point = self._point(name, path, onward)
        return lambda token: pass_token(token, point)

    def _point(self, name: str, path: str, onward: Deliver) -> JoinPoint:
        point = JoinPoint(name, path, self, onward)
        for other in self.points[name]:
            if other.port == path:  # another connection of the same port: one stream, one memory
                point.random, point.memory, point.counts = other.random, other.memory, other.counts
                return point
        self.points[name].append(point)
        return point

    # -- running --------------------------------------------------------------------------------------------------

    def run(
        self, *, until: float | None = None, progress: Callable[[float], None] | None = None
    ) -> Results:
        """Run to the end and return what came of it; an exception in an actor is raised as ``ActorError``."""
        stop = self.model.stop if until is None else round(until * 1e9)
        actors = list(self.model.graph.actors.values())
        director = self.director
        director.finished = lambda: self._stop_asked
        for actor in actors:
            actor.enter(director)
        started = time.perf_counter()
        try:
            for actor in actors:
                self._call(actor, "initialize")
            director.run(stop, progress)
        except ActorError as error:
            raise self._placed(error) from error.__cause__
        finally:
            for actor in actors:
                self._call(actor, "wrapup")
            self._wall_time = time.perf_counter() - started
        return self.results("stop_when" if self._stop_asked else "stop time" if stop is not None else "no events left")

    def results(self, stopped: str) -> Results:
        """What there is so far; after a failed run, what was recorded until then."""
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
            wall_time=self._wall_time,
        )

    def _call(self, actor: Actor, method: str) -> None:
        try:
            getattr(actor, method)()
        except EpicycleError:
            raise
        except Exception as error:
            raise ActorError(actor.path, self.tag, f"{method}()", describe(error)) from error

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


def _all(ways: list[Deliver]) -> Deliver:
    """One way that takes all of them."""
    if len(ways) == 1:
        return ways[0]

    def onward(token: Any) -> None:
        for way in ways:
            way(token)

    return onward
