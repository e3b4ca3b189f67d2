"""Simulation: a model, wired up, woven and run."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

from epicycle.actors import Actor, EpicycleError, to_nanoseconds, to_seconds

from ..collection import without_collection
from ..model import Model, WovenAspect, describe, raised_at
from .director import ActorError, Director
from .interrupt import between_steps
from .local import Deliver
from .log import EventLog, Record
from .log_filter import LogFilter
from .measurement import Measurement
from .pace import Pace
from .results import Results
from .signal import Signal
from .trace import Tracer, TracingDirector, TracingLog
from .wiring import Wiring


class Simulation:
    """One run of a model, which is checked first and may not be changed between this and ``run``.

    A model can be run any number of times, one after the other, each time by a Simulation of its own.  ``keep_log``
    keeps the records of the event log, all or those that a ``LogFilter`` lets pass; ``log_to``, such as
    ``LogFile.add``, is given them instead.

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
        _refuse_running(model)
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
        limits = model.graph.limits
        self.director = (
            Director(order, self.seed, limits) if tracer is None else TracingDirector(order, self.seed, tracer, limits)
        )
        self.log.crowd = self.director.crowd
        self.signals = {name: Signal(name) for name in model.recorded}
        self._measurements = {metric.name: Measurement(metric) for metric in model.metrics}
        self._has_run = False
        self._started = 0.0
        self._stop: int | None = None
        self._unreported: ActorError | None = None
        try:
            with without_collection():
                self._wiring = Wiring(model, self.director, self.log, self._listeners(), self.signals)
        except ActorError as error:  # of a clock that is wrong in a way that cannot be told
            raise self._placed(error) from _cause(error)

    # -- what is watched ------------------------------------------------------------------------------------------

    def _listeners(self) -> dict[str, list[Deliver]]:
        """Recorders, metrics and the stop rule, by the path of the port that they listen to."""
        found: dict[str, list[Deliver]] = {}
        for name, signal in self.signals.items():
            found.setdefault(name, []).append(partial(self._record, signal))
        for metric in self.model.metrics:
            for path in metric.ports:
                found.setdefault(path, []).append(partial(self._measure, self._measurements[metric.name], path))
        for path in self.model.stop_ports:
            found.setdefault(path, []).append(partial(self._ask_to_stop, path))
        return found

    def _record(self, signal: Signal, token: Any) -> None:
        signal.add(self.director.tag, token)

    def _measure(self, measurement: Measurement, path: str, token: Any) -> None:
        measurement.add(path, self.director.tag.time, token)

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
        _refuse_running(self.model)
        self._has_run = True
        stop = self._stop = self.model.stop_time if until is None else to_nanoseconds(until)
        actors = list(self.model.graph.actors.values())
        director = self.director
        begun: list[Actor] = []
        self.model.is_running = True
        try:
            for actor in actors:
                actor.enter(self._wiring.context_of(actor.path))
                for port in actor.inputs.values():
                    port.clear()  # of what a failed run has left there
            self._started = time.perf_counter()
            for actor in actors:
                self._call(actor, "initialize")
                begun.append(actor)
            self._wiring.begin()
            # Ports are open only while actors fire: nothing is sent in initialize and wrapup.
            self._wiring.open()
            with between_steps(director.interrupt):
                stopped = director.run(stop, actors, progress, pace)
        except ActorError as error:
            raise self._placed(error) from _cause(error)
        finally:
            try:
                self._wiring.close()
                if self._tracer is not None:
                    self._tracer.end()
                late = self._wrap_up(begun)
            finally:
                self.model.is_running = False
        results = self.results(stopped)
        late = late or self._unreported
        if late is not None:
            raise self._placed(late) from _cause(late)
        return results

    def results(self, stopped: str) -> Results:
        """What has come of the run so far; ``stopped`` says why it is over."""
        # What stood at the last event stands until the stop time, if that is what ended the run.
        end = self._stop if stopped == "stop time" and self._stop is not None else self.director.last.time
        outcomes = {name: each.outcome(end) for name, each in self._measurements.items()}
        return Results(
            model=self.model.name,
            seed=self.seed,
            parameters=dict(self.model.parameters),
            metrics={name: each.value for name, each in outcomes.items()},
            aspects=self._figures(),
            signals=self.signals,
            log=self.log,
            end=to_seconds(self.director.last.time),
            stopped=stopped,
            firings=self.director.firings,
            wall_time=time.perf_counter() - self._started,
            units={metric.name: metric.unit for metric in self.model.metrics},
            outcomes=outcomes,
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
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            raise ActorError(actor.path, self.director.tag, f"{method}()", describe(error)) from error

    def _placed(self, error: ActorError) -> ActorError:
        """The error with the place in the model file where its actor is declared, and the user's line it comes from."""
        position = self.model.position_of(error.path)
        where = f"{position.file}:{position.line}:{position.column}" if position else ""
        return ActorError(error.path, error.tag, error.doing, error.reason, where, raised_at(_cause(error)))

    def _figures(self) -> dict[str, dict[str, float | None]]:
        """How often each event of each aspect happened, over all its ports, and what the aspect reports."""
        figures: dict[str, dict[str, float | None]] = {}
        for woven in self.model.aspects:
            total = dict.fromkeys(woven.aspect.events, 0)
            for point in self._wiring.points[woven.name]:
                for event, number in point.counts.items():
                    total[event] = total.get(event, 0) + number
            figures[woven.name] = {**total, **self._report(woven)}
        return figures

    def _report(self, woven: WovenAspect) -> dict[str, float | None]:
        """What an aspect reports; if it fails, that is told when all results are there."""
        try:
            return dict(woven.aspect.report(self._wiring.shared(woven), self.director.last.time))
        except Exception as error:
            self._unreported = ActorError(f"aspect {woven.name}", self.director.tag, "report()", describe(error))
            self._unreported.__cause__ = error
            return {}


def _refuse_running(model: Model) -> None:
    """Its actors can be part of one run at a time."""
    if model.is_running:
        raise EpicycleError(
            f"{model.name} is being run by another Simulation: wait until that is over, or load or build the model "
            "once more"
        )


def _cause(error: ActorError) -> BaseException | None:
    """What an actor really raised: SimPy raises a copy of an error, whose cause the error itself is."""
    cause = error.__cause__
    while isinstance(cause, ActorError):
        cause = cause.__cause__
    return cause
