"""Simulation: runs a model, at once or step by step; its state can be saved and restored."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar, overload

import simpy
from simpy.events import Event

from epicycle.actors import Actor, EpicycleError, Process, Tag, did_you_mean, to_nanoseconds
from epicycle.aspects import Aspect

from ...model.build.model import Model
from ...model.graph.woven import WovenAspect
from ...support.collection import without_collection
from ...support.tables import Table, Tabled
from ..results import STOP_TIME, EventLog, Record, Results, Signal, Verdict
from .attached import Attached
from .copies import Copies
from .director import Director
from .interventions import Interventions
from .log_filter import LogFilter
from .pace import Pace
from .run import Run
from .trace import Tracer

Part = TypeVar("Part", bound=Actor | Aspect)


class SnapshotError(EpicycleError):
    """A run that cannot be saved or restored."""


class Snapshot:
    """A run at a tag, from which any number of runs can continue: see ``Simulation.snapshot``."""

    def __init__(self, run: Run) -> None:
        self.model = run.model
        self.seed = run.seed
        self.tag = run.director.last
        self._digest = run.log.digest  # this encodes everything that waits in the log
        self._steps = run.director.steps
        # Python cannot copy a generator: instead of processes, the way to their state is kept.
        has_processes = run.is_begun and any(isinstance(actor, Process) for actor in run.actors.values())
        self.run = None if has_processes else _copy(run)  # a copy that does not run
        self._keeps = run.keeps
        self._acts = None if run.acts is None else run.acts.anew()
        self._reseeds = tuple(run.reseeds)

    def again(self) -> Run:
        """A run that continues from here; raises ``SnapshotError``."""
        if self.run is not None:
            return _copy(self.run)
        acts = None if self._acts is None else self._acts.anew()
        run = Run(self.model, self.seed, self._keeps, acts=acts)
        for is_begun, steps, seed in self._reseeds:
            if is_begun:
                run.advance(None, most=steps - run.director.steps)
            run.reseed(seed)
        run.advance(None, most=self._steps - run.director.steps)
        if (run.director.last, run.log.digest) != (self.tag, self._digest):
            raise SnapshotError(
                f"{self.model.name} has processes, so its run was repeated from the start to go back to {self.tag}, "
                "but the repeated run is different: the model was changed, or something depends on more than model "
                "and seed"
            )
        return run

    def __repr__(self) -> str:
        return f"<Snapshot of {self.model.name}, seed {self.seed}, at {self.tag}>"


def _copy(run: Run) -> Run:
    with without_collection():
        return Copies(run.outside).of(run)


class Simulation(Tabled):
    """One run of a model, which is checked first; runs do not change it.

    The model is compiled into actors, aspects and ways of this run alone: any number of simulations of a model can run
    at once, in turn or in threads.  ``simulation["sink"]``, or ``simulation[sink]`` with the object that was added to
    the model, is the actor of this run.  ``keep_log`` keeps the records of the event log, all or those that pass a
    ``LogFilter``; ``log_to``, such as ``LogFile.add``, receives them instead.  With ``acts``, the acts of aspects on
    single tokens have names, and some of them can be left out.

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
        acts: Interventions | None = None,
    ) -> None:
        model.check()
        if keep_log is True:
            keep_log = LogFilter({})
        if keep_log:
            keep_log.check(model)
        seed = model.output.seed if seed is None else seed
        if seed < 0:
            raise ValueError(f"a seed is a whole number of at least 0, not {seed}")
        self.model = model
        self._is_told_of = log_to is not None or tracer is not None
        self._parts = _parts(model.graph.actors, model.aspects)
        self._attached: Attached | None = None
        self._run = Run(model, seed, keep_log.keeps if keep_log else None, log_to, tracer, acts)

    def __repr__(self) -> str:
        return f"<Simulation of {self._caption()}>"

    def _caption(self) -> str:
        end = "" if self.model.stop is None else f" of {self.model.stop:g} s"
        state = "over" if self._run.is_over else "paused" if self._run.is_begun else "not started"
        return f"{self.model.name}, seed {self.seed}: at {self.tag.seconds:g} s{end}, {state}"

    def _tables(self) -> list[Table]:
        return self.results("the program")._tables()

    # -- running --------------------------------------------------------------------------------------------------

    def run(
        self,
        *,
        until: float | None = None,
        progress: Callable[[float], None] | None = None,
        pace: Pace | None = None,
        most: int | None = None,
    ) -> Results:
        """Run to the end and return the results; an exception in an actor is raised as ``ActorError``.

        ``until`` is the stop time (s, default: the model's), ``progress`` is called with the time now and then, and
        ``pace`` limits the run to the wall clock.  A run that is not over after ``most`` tags ends there.
        """
        self._refuse_over()
        stop = self.model.output.stop_time if until is None else to_nanoseconds(until)
        self._run.advance(stop, most=most, progress=progress, pace=pace)
        return self._run.finish()

    def advance(self, until: float) -> bool:
        """Run up to and including a time (s); returns whether there is more to come after it."""
        self._refuse_over()
        stop, last = to_nanoseconds(until), self.model.output.stop_time
        is_last = last is not None and stop >= last
        return self._run.advance(last if is_last else stop) == STOP_TIME and not is_last

    def reach(self, robustness: Mapping[str, float], *, until: float | None = None) -> bool:
        """Go on until the ``robustness`` of one of these monitors is at most the number given; whether one is.

        The run pauses before the time advances, when everything at the present time is done.  If there is none, or only
        at the end, it has come to its stop time (``until``, in s, or the model's), or there is nothing more to do.
        """
        self._refuse_over()
        for name in robustness:
            self._run.monitoring(name)
        self._run.reach(self.model.output.stop_time if until is None else to_nanoseconds(until), robustness)
        return any(self.robustness(name) <= least for name, least in robustness.items())

    def advance_until(self, condition: Callable[[], bool]) -> bool:
        """Run until a condition holds, or to the stop time; returns whether it holds.

        The condition is asked whenever the time is about to advance: everything at the present time is done.  This is
        for many short parts of a run: Ctrl-C may end one in the middle of a firing.
        """
        self._refuse_over()
        return self._run.advance_until(self.model.output.stop_time, condition)

    def step(self) -> bool:
        """Handle the next tag, or SimPy events before it; returns whether there was anything until the stop time."""
        self._refuse_over()
        return not self._run.advance(self.model.output.stop_time, most=1)

    def finish(self) -> Results:
        """End the run where it is, and return the results."""
        if self._attached is not None and not self._run.is_over:
            return self._attached.finish()
        self._refuse_over()
        return self._run.finish()

    def attach(self, env: simpy.Environment, *, until: float | None = None) -> Event:
        """Let a program's own SimPy environment run this: both have one clock, and may share resources and events.

        The run begins at the time of ``env`` (s), with which it advances from then on.  At one instant all events of
        SimPy come first, of the program and of the run's processes in the order of SimPy; then the tags of the run.
        Returns an event that happens at the end of the run (``until``, in s, default: the model's stop time; or when
        ``finish`` is called), with its ``Results``: ``results = env.run(until=simulation.attach(env))``.
        An exception in an actor is raised by ``env.run`` as ``ActorError``.
        """
        self._refuse_over()
        if self._run.is_begun:
            raise EpicycleError(f"the run of {self.model.name} has begun: attach another Simulation to the environment")
        stop = self.model.output.stop_time if until is None else to_nanoseconds(until)
        self._attached = Attached(self._run, env, stop)
        return self._attached.done

    def results(self, stopped: str) -> Results:
        """The results so far; ``stopped`` says why the run is over."""
        return self._run.results(stopped)

    def robustness(self, monitor: str) -> float:
        """What the robustness of a monitor is at most, whatever comes; infinity if nothing is certain yet.

        Of ``always p`` that is the least margin so far.  Of ``eventually p`` nothing is certain before its end.
        """
        monitoring = self._run.monitoring(monitor)
        monitoring.settle(self.tag.time)
        return monitoring.most

    def verdict(self, monitor: str) -> Verdict:
        """What a monitor comes to if the run ends where it has come to."""
        return self._run.verdict(monitor, self._run.stopped)

    def _refuse_over(self) -> None:
        if self._attached is not None and not self._run.is_over:
            raise EpicycleError(
                f"the run of {self.model.name} is attached to a SimPy environment, which lets its time pass: run that"
            )
        if self._run.is_over:
            raise RuntimeError("a Simulation runs once: make another one for another run")

    # -- going back -----------------------------------------------------------------------------------------------

    def snapshot(self) -> Snapshot:
        """The run as it is now, between two tags: ``restore`` and ``fork`` continue from there as this one would.

        It holds copies of all parts of the run.  Python cannot copy processes (``Process``): with these, it holds only
        how far the run has come, and restoring it repeats the run up to there.  Raises ``SnapshotError`` for a run that
        is over, or that reports to others; ``CopyError`` for parts that cannot be copied.
        """
        self._refuse_told()
        if self._attached is not None:
            raise SnapshotError(
                f"the run of {self.model.name} is attached to a SimPy environment, which cannot be copied"
            )
        if self._run.is_over:
            raise SnapshotError(f"the run of {self.model.name} is over: take a snapshot before its end")
        return Snapshot(self._run)

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to a snapshot of a run of the same model, whatever the state of this one.

        Actors are copies of those in the snapshot: get them again from ``simulation["path"]``.
        """
        self._refuse_told()
        if snapshot.model is not self.model:
            raise SnapshotError(f"{snapshot!r} is of another model than this simulation of {self.model.name}")
        self._run = snapshot.again()

    def fork(self, *, reseed: int | None = None) -> Simulation:
        """Another simulation that continues from here, as this one does unless something in it is changed.

        With ``reseed``, each random stream becomes the one that a run with this seed would have: what was drawn before
        stays as it is, and what is drawn from here on depends on this seed alone.
        """
        snapshot, fork = self.snapshot(), copy.copy(self)
        fork._run = snapshot.run or snapshot.again()
        if reseed is not None:
            fork._run.reseed(reseed)
        return fork

    def _refuse_told(self) -> None:
        if self._is_told_of:
            raise SnapshotError(
                f"the run of {self.model.name} reports to log_to or to a tracer, which cannot be undone: leave them out"
            )

    # -- its parts ------------------------------------------------------------------------------------------------

    @overload
    def __getitem__(self, part: str) -> Actor: ...
    @overload
    def __getitem__(self, part: Part) -> Part: ...
    def __getitem__(self, part: str | Part) -> Any:
        """The actor of this run with a path, or the part that belongs to an actor or aspect object of the model."""
        found: Any = None
        if isinstance(part, str):
            found = self.actors.get(part)
        else:
            pairs = zip(self._parts, _parts(self._run.actors, self._run.aspects), strict=True)
            found = next((ours for own, ours in pairs if own is part), None)
        if found is None:
            name, known = (part, did_you_mean(part, self.actors)) if isinstance(part, str) else (repr(part), "")
            raise EpicycleError(f"{name} is not part of {self.model.name}{known}")
        return found

    @property
    def actors(self) -> Mapping[str, Actor]:
        """The actors of this run, by path."""
        return self._run.actors

    @property
    def seed(self) -> int:
        """The seed of this run."""
        return self._run.seed

    @property
    def tag(self) -> Tag:
        """The tag that was handled last; (0, 0) before the first."""
        return self._run.director.last

    @property
    def director(self) -> Director:
        """The director, which fires the actors."""
        return self._run.director

    @property
    def log(self) -> EventLog:
        """The event log so far."""
        return self._run.log

    @property
    def signals(self) -> dict[str, Signal]:
        """The signals recorded so far."""
        return self._run.signals


def _parts(actors: Mapping[str, Actor], aspects: Iterable[WovenAspect]) -> list[Actor | Aspect]:
    return [*actors.values(), *(woven.aspect for woven in aspects)]
