"""Simulation: a model, wired up, woven and run."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

from epicycle.actors import Actor, to_nanoseconds, to_seconds

from ..collection import without_collection
from ..model import Metric, Model
from .director import ActorError, Director, describe
from .local import Deliver
from .log import EventLog, Record
from .log_filter import LogFilter
from .pace import Pace
from .results import Reduction, Results
from .signal import Signal
from .trace import Tracer, TracingDirector, TracingLog
from .wiring import Wiring


class Simulation:
    """One run of a model, which is checked first and may not be changed between this and ``run``.

    A model can be run any number of times, each time by a Simulation of its own.  ``keep_log`` keeps the records of the
    event log, all or those that a ``LogFilter`` lets pass; ``log_to`` is given them instead, as by a ``LogFile``.

    >>> results = Simulation(load_model("collision_avoidance"), seed=7).run()
    """

    def __init__(
        self,
        model: Model,
        *,
        seed: int | None = None,
        keep_log: bool | LogFilter = False,
        log_to: Callable[[Record], None] | None = None,
        tracer: Tracer | None = None,
    ) -> None:
        model.check()
        if keep_log is True:
            keep_log = LogFilter({})
        if keep_log:
            keep_log.check(model)
        self.model = model
        self.seed = model.seed if seed is None else seed
        if self.seed < 0:
            raise ValueError(f"a seed is a whole number from 0 up, not {self.seed}")
        self._tracer = tracer
        order = model.order()
        keeps = keep_log.keeps if keep_log else None
        self.log = EventLog(keeps, log_to) if tracer is None else TracingLog(keeps, tracer)
        self.director = Director(order, self.seed) if tracer is None else TracingDirector(order, self.seed, tracer)
        self.signals = {name: Signal(name) for name in model.recorded}
        self._reductions = [(metric, Reduction(metric.take)) for metric in model.metrics]
        self._has_run = False
        self._started = 0.0
        with without_collection():
            self._wiring = Wiring(model, self.director, self.log, self._listeners(), self.signals)

    # -- what is watched ------------------------------------------------------------------------------------------

    def _listeners(self) -> dict[str, list[Deliver]]:
        """Recorders, metrics and the stop rule, by the path of the port that they listen to."""
        found: dict[str, list[Deliver]] = {}
        for name, signal in self.signals.items():
            found.setdefault(name, []).append(partial(self._record, signal))
        for metric, reduction in self._reductions:
            for path in metric.ports:
                found.setdefault(path, []).append(partial(self._measure, metric, reduction, path))
        for path in self.model.stop_ports:
            found.setdefault(path, []).append(partial(self._ask_to_stop, path))
        return found

    def _record(self, signal: Signal, token: Any) -> None:
        signal.add(self.director.tag, token)

    def _measure(self, metric: Metric, reduction: Reduction, path: str, token: Any) -> None:
        try:
            reduction.add(token)
        except Exception as error:
            doing = f"taking the {metric.take} of {path}"
            raise ActorError(f"metric {metric.name}", self.director.tag, doing, describe(error)) from error

    def _ask_to_stop(self, path: str, token: Any) -> None:
        try:
            if token:
                self.director.stop("stop_when")
        except ValueError as error:  # arrays are neither true nor false
            raise ActorError("stop_when", self.director.tag, f"asking {path}", describe(error)) from error

    # -- running --------------------------------------------------------------------------------------------------

    def run(
        self,
        *,
        until: float | None = None,
        progress: Callable[[float], None] | None = None,
        pace: Pace | None = None,
    ) -> Results:
        """Run to the end and return what came of it; an exception in an actor is raised as ``ActorError``.

        ``until`` is the stop time (s, default: the model's), ``progress`` is told of the time now and then, and
        ``pace`` holds the run to the wall clock.
        """
        if self._has_run:
            raise RuntimeError("a Simulation runs once: make another one for another run")
        self._has_run = True
        stop = self.model.stop_time if until is None else to_nanoseconds(until)
        actors = list(self.model.graph.actors.values())
        director = self.director
        for actor in actors:
            actor.enter(self._wiring.context_of(actor.path))
            for port in actor.inputs.values():
                port.clear()  # of what a failed run has left there
        self._started = time.perf_counter()
        begun: list[Actor] = []
        try:
            for actor in actors:
                self._call(actor, "initialize")
                begun.append(actor)
            self._wiring.begin()
            # Ports are open only while actors fire: nothing is sent in initialize and wrapup.
            self._wiring.open()
            stopped = director.run(stop, actors, progress, pace)
        except ActorError as error:
            raise self._placed(error) from error.__cause__
        finally:
            self._wiring.close()
            if self._tracer is not None:
                self._tracer.end()
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
            aspects=self._figures(),
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

    def _figures(self) -> dict[str, dict[str, float | None]]:
        """How often each event of each aspect happened, over all its ports, and what the aspect reports."""
        figures: dict[str, dict[str, float | None]] = {}
        for woven in self.model.aspects:
            total = dict.fromkeys(woven.aspect.events, 0)
            for point in self._wiring.points[woven.name]:
                for event, number in point.counts.items():
                    total[event] = total.get(event, 0) + number
            figures[woven.name] = {
                **total,
                **woven.aspect.report(self._wiring.shared(woven), self.director.last.time),
            }
        return figures
