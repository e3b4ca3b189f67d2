"""Run: a model, compiled into everything that changes during a run."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from typing import Any

from epicycle.actors import Actor, EpicycleError, Receiver, did_you_mean, to_seconds

from ...model.build.model import Model
from ...model.graph.woven import WovenAspect
from ...model.text.program import describe, raised_at
from ...support.collection import seldom_collecting, without_collection
from ...support.interrupt import between_steps
from ..results import STOP_TIME, EventLog, Record, Results, Signal, Verdict
from .copies import Copies
from .director import NO_EVENTS, Director
from .directors import director_of
from .errors import ActorError
from .forms import attach
from .interventions import Interventions
from .loop import handle_events
from .measured import Measured, add_computed
from .measurement import Measuring
from .monitoring import Listening, Monitoring
from .pace import Pace
from .receivers import Deliver, Recording
from .trace import Tracer, Tracing, TracingLog, tracing
from .wiring import Wiring

Keeps = Callable[[str, str, str, str], bool]


class Run:
    """The state of one run: its own actors and aspects, the ways between them, agenda, log, and measurements.

    The model that it was made from is not changed.
    """

    def __init__(
        self,
        model: Model,
        seed: int,
        keeps: Keeps | None = None,
        log_to: Callable[[Record], None] | None = None,
        tracer: Tracer | None = None,
        acts: Interventions | None = None,
    ) -> None:
        self.model = model
        self.seed = seed
        self.keeps = keeps
        self.is_begun = self.is_over = False
        self.stopped = ""  # why the run is over, once it is
        self._tracer = tracer
        if acts is None and model.exactly is not None:
            acts = Interventions(model.exactly)
        self.acts = acts  # of aspects, where they have names
        self._stop: int | None = None  # the time (ns) up to which it has been allowed to run
        self._spent = 0.0  # s of the wall clock
        self._initialized: list[Actor] = []
        self._unreported: ActorError | None = None
        self.reseeds: list[tuple[bool, int, int]] = []  # whether it had begun, after how many steps, and the seed
        self._awaited: Mapping[str, float] = {}  # robustness of monitors at which it is to pause
        order, limits = model.order(), model.graph.limits
        self.log = EventLog(keeps, log_to) if tracer is None else TracingLog(keeps, tracer)
        kind = director_of(model.graph)
        self.director: Director = (kind if tracer is None else tracing(kind))(order, seed, limits, model.graph)
        if isinstance(self.director, Tracing) and tracer is not None:
            self.director.begin_trace(tracer)
        self.log.crowd = self.director.crowd.add
        self.signals = {name: Signal(name) for name in model.output.recorded}
        self._units = {metric.name: metric.unit for metric in model.output.metrics}
        self._measurements = {metric.name: Measured(metric) for metric in model.output.metrics if metric.is_measured}
        self._monitorings = {monitor.name: Monitoring(monitor) for monitor in model.output.monitors}
        try:
            with without_collection():
                self.outside: list[object] = [model, model.graph]  # with everything else that leads there
                copies = Copies(self.outside, self.outside)
                self.actors = {path: copies.of(actor) for path, actor in model.graph.actors.items()}
                self.aspects = [replace(woven, aspect=copies.of(woven.aspect)) for woven in model.aspects]
                listeners = self._listeners()
                self._ways = Wiring(
                    model.graph, self.actors, self.aspects, self.director, self.log, listeners, self.signals, self.acts
                )
        except ActorError as error:  # from a clock whose error cannot be computed
            raise self._placed(error) from _cause(error)

    # -- listeners ------------------------------------------------------------------------------------------------

    def _listeners(self) -> dict[str, list[Deliver | Receiver]]:
        """Recorders, metrics and the stop rule, by the path of the port that they listen to."""
        found: dict[str, list[Deliver | Receiver]] = {}
        for name, signal in self.signals.items():
            found.setdefault(name, []).append(Recording(signal.samples, self.director))
        for metric in self.model.output.metrics:
            for path in metric.ports if metric.is_measured else ():
                measuring = Measuring(self._measurements[metric.name].at(path), path, self.director)
                found.setdefault(path, []).append(measuring)
        for monitor in self.model.output.monitors:
            for part in self._monitorings[monitor.name].parts:
                for path in part.part.ports:
                    found.setdefault(path, []).append(Listening(part, path, self.director))
        if any(monitor.requirement.stop for monitor in self.model.output.monitors):
            self.director.watch = self._stop_if_broken
        for path in self.model.output.stop_ports:
            sources = self.model.graph.source_of(path)
            is_event = all(port.name in port.actor.event_outputs for port in sources)
            found.setdefault(path, []).append(partial(self._ask_to_stop, path, is_event))
        return found

    def _ask_to_stop(self, path: str, is_event: bool, token: Any) -> None:
        try:
            if is_event or token:
                self.director.stop("stop_when")
        except ValueError as error:  # arrays are neither true nor false
            raise ActorError("stop_when", self.director.tag, f"asking {path}", describe(error)) from error

    def _stop_if_broken(self, upcoming: int) -> bool:
        """Before the time advances: end the run if a monitor that asks for it is broken."""
        found = False
        for name, monitoring in self._monitorings.items():
            if monitoring.monitor.requirement.stop:
                monitoring.settle(upcoming)
                if monitoring.is_broken:
                    self.director.stop(f"monitor {name}")
                    found = True
        return found

    def _is_awaited(self, upcoming: int) -> bool:
        """Before the time advances: whether a monitor has come to what is awaited of it, or ends the run."""
        for name in self._awaited:
            self._monitorings[name].settle(upcoming)
        if any(self._monitorings[name].most <= robustness for name, robustness in self._awaited.items()):
            self._awaited = {}
            return True
        return self._stop_if_broken(upcoming)

    def monitoring(self, name: str) -> Monitoring:
        """That of a monitor; raises ``EpicycleError``."""
        if name not in self._monitorings:
            near = did_you_mean(name, self._monitorings)
            raise EpicycleError(
                f"{self.model.name} has no monitor {name!r}{near}\n"
                f"   help: its monitors: {', '.join(self._monitorings) or 'none'}"
            )
        return self._monitorings[name]

    # -- running --------------------------------------------------------------------------------------------------

    def advance(
        self,
        stop: int | None,
        *,
        most: int | None = None,
        progress: Callable[[float], None] | None = None,
        pace: Pace | None = None,
        is_short: bool = False,
    ) -> str:
        """Run until ``stop`` (ns), for at most ``most`` steps; returns why there is no more to do until then, if so.

        An exception ends the run; one of an actor is raised as ``ActorError``.  Ctrl-C comes between two steps, but for
        ``is_short``, because to arrange for that takes as long as some steps.
        """
        self._stop = stop
        started = time.perf_counter()
        try:
            with seldom_collecting():
                if not self.is_begun:
                    self._begin()
                with nullcontext() if is_short or most == 1 else between_steps(self.director.interrupt):
                    self.stopped = handle_events(self.director, stop, [*self.actors.values()], progress, pace, most)
        except BaseException as error:
            self.end()
            if isinstance(error, ActorError):
                raise self._placed(error) from _cause(error)
            raise
        finally:
            self._spent += time.perf_counter() - started
        return self.stopped

    def reach(self, stop: int | None, robustness: Mapping[str, float]) -> None:
        """Go on until ``stop`` (ns), or until the robustness of a monitor is known to be at most the one given."""
        before, self._awaited = self.director.watch, robustness
        self.director.watch = self._is_awaited
        try:
            self.advance(stop)
            if robustness and not self._awaited:
                self.stopped = ""  # it is not over
            for name in self._awaited:
                self._monitorings[name].settle(self._end(self.stopped) + 1)
        finally:
            self.director.watch, self._awaited = before, {}

    def advance_until(self, stop: int | None, condition: Callable[[], bool]) -> bool:
        """Go on until ``stop`` (ns), or until a condition holds before the time advances; whether it does."""
        before, holds = self.director.watch, False

        def watch(upcoming: int) -> bool:
            nonlocal holds
            holds = condition()
            return holds or (before is not None and before(upcoming))

        self.director.watch = watch
        try:
            self.advance(stop, is_short=True)
        finally:
            self.director.watch = before
        holds = holds or (self.stopped == NO_EVENTS and condition())
        if holds:
            self.stopped = ""  # it is not over
        return holds

    def reseed(self, seed: int) -> None:
        """From now on draw the random numbers of a run with another seed."""
        self.reseeds.append((self.is_begun, self.director.steps, seed))
        self.director.streams.reseed(seed)

    def _begin(self) -> None:
        self.is_begun = True
        for path, actor in self.actors.items():
            actor.enter(self._ways.context_of(path))
        before = ""
        for path, actor in self.actors.items():
            self._ways.directors.start(before, path)
            self._call(actor, "initialize")
            self._initialized.append(actor)
            before = path
        self._ways.directors.start(before, "")
        self._ways.begin()
        # Ports are open only while actors fire: nothing is sent in initialize and wrapup.
        self._ways.open()
        attach(self.director, self.actors, self._ways.executed)

    def end(self) -> ActorError | None:
        """Let every actor wrap up, whatever happened before; returns the first error."""
        self.is_over = True
        self._ways.close()
        if self._tracer is not None:
            self._tracer.end()
        first = None
        for actor in self._initialized:
            try:
                self._call(actor, "wrapup")
            except ActorError as error:
                first = first or error
        return first

    def live_in(self, environment: Any) -> None:
        """Let processes live in an environment from outside; before the run begins."""
        self._ways.live_in(environment)

    def failed(self, error: ActorError) -> ActorError:
        """End the run because of an error; the error with its places."""
        self.end()
        return self._placed(error)

    def finish(self) -> Results:
        """End the run; its results."""
        late = self.end()
        results = self.results(self.stopped or "the program")
        late = late or self._unreported
        if late is not None:
            raise self._placed(late) from _cause(late)
        return results

    def results(self, stopped: str) -> Results:
        """The results so far; ``stopped`` says why the run is over."""
        end = self._end(stopped)
        verdicts = {name: self.verdict(name, stopped) for name in self._monitorings}
        outcomes = {}  # of copies, because reading a measurement ends it
        for metric in self.model.output.metrics:
            if metric.is_measured:
                outcomes[metric.name] = Copies().of(self._measurements[metric.name]).outcome(end)
            elif metric.monitor:
                outcomes[metric.name] = verdicts[metric.monitor].outcome(metric.name == metric.monitor)
        outcomes = add_computed(self.model.output.metrics, outcomes)
        return Results(
            model=self.model.name,
            seed=self.seed,
            parameters=dict(self.model.parameters),
            metrics={name: each.value for name, each in outcomes.items()},
            aspects=self._figures(end),
            signals=self.signals,
            log=self.log,
            end=to_seconds(self.director.last.time),
            until=to_seconds(end),
            stopped=stopped,
            firings=self.director.firings,
            wall_time=self._spent,
            units=dict(self._units),
            outcomes=outcomes,
            figures=dict(self.model.figures),
            program=self.model,
            monitors=verdicts,
            acts=[] if self.acts is None else self.acts.noted,
        )

    def verdict(self, name: str, stopped: str) -> Verdict:
        """What a monitor comes to if the run is over."""
        # Of a copy, because reading a monitoring ends it.
        return Copies().of(self.monitoring(name)).verdict(self._end(stopped))

    def _end(self, stopped: str) -> int:
        end = self.director.last.time
        if stopped == STOP_TIME and self._stop is not None:
            end = max(end, self._stop)  # the values at the last event last until then
        return end

    def _call(self, actor: Actor, method: str) -> None:
        try:
            getattr(actor, method)()
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            raise ActorError(actor.path, self.director.tag, f"{method}()", describe(error)) from error

    def _placed(self, error: ActorError) -> ActorError:
        """The error with the place in the model file that declares its actor, and the line of user code behind it."""
        position = self.model.position_of(error.path)
        where = f"{position.file}:{position.line}:{position.column}" if position else ""
        return ActorError(error.path, error.tag, error.doing, error.reason, where, raised_at(_cause(error)))

    def _figures(self, end: int) -> dict[str, dict[str, float | None]]:
        """How often each event of each aspect happened, over all its ports, and what the aspect reports at the end."""
        figures: dict[str, dict[str, float | None]] = {}
        for woven in self.aspects:
            total = dict.fromkeys(woven.aspect.events, 0)
            for point in self._ways.points[woven.name]:
                for event, number in point.counts.items():
                    total[event] = total.get(event, 0) + number
            figures[woven.name] = {**total, **self._report(woven, end)}
        return figures

    def _report(self, woven: WovenAspect, end: int) -> dict[str, float | None]:
        """The report of an aspect; if it fails, the error is raised once all results are complete."""
        try:
            return dict(woven.aspect.report(self._ways.shared(woven), end))
        except Exception as error:
            self._unreported = ActorError(f"aspect {woven.name}", self.director.tag, "report()", describe(error))
            self._unreported.__cause__ = error
            return {}


def _cause(error: ActorError) -> BaseException | None:
    """The exception that an actor raised: SimPy raises a copy, whose cause is the original."""
    cause = error.__cause__
    while isinstance(cause, ActorError):
        cause = cause.__cause__
    return cause
