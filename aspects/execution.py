"""Disturbances of execution: firings that take time, share a processor or do not happen, and crashes."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

from epicycle.actors import (
    EpicycleError,
    Parameter,
    array_parameter,
    did_you_mean,
    read_table,
    to_nanoseconds,
    to_seconds,
)

from .core import (
    ActorPoint,
    ByActorParameter,
    DurationParameter,
    ExecutionAspect,
    FiringTime,
    FiringTimeParameter,
    Job,
    Server,
    Target,
    Task,
    drawn,
    time_needed,
)

WAIT, SKIP = "wait", "skip"
FCFS, PRIORITY, EDF = "fcfs", "priority", "edf"
LOST, KEPT = "lost", "kept"


class ExecutionTime(ExecutionAspect):
    """Makes the firings of an actor take time: it fires at the end, with the tokens from the beginning.

    A firing takes ``scale`` * (``time`` + the next of the measured ``times``), if the actor has work: tokens at ports
    that do not trigger it are only stored, which costs no time.  With a ``time`` for each port that costs time,
    ``{trigger: 60 ms, peer_plans: 1 ms}``, a firing takes the longest of those of the ports at which tokens came.  An
    actor does one thing after another: a firing that falls due meanwhile waits for its turn, or is skipped.  A firing
    for a wake-up, or one that takes no time, always waits, because an actor that misses a wake-up may never request the
    next.

    With ``measure``, nothing is delayed.  Instead, the actual computing time of each firing is recorded as the signal
    ``NAME@ACTOR``, and the ``signals.parquet`` of that run can be given as ``times`` to later runs.  The measuring run
    has the log of a run without the aspect, and each run that takes the times from a file is reproducible. The times of
    an actor are used in order, and again from the first when they are used up.
    Events: ``delayed``, with the seconds from when the firing fell due, and ``skipped``.
    """

    events: ClassVar[tuple[str, ...]] = ("delayed", "skipped")

    time = FiringTimeParameter(
        0.0, doc="execution time of a firing, or a distribution; or {port: time} for each input port that costs time"
    )
    times = Parameter(
        Path,
        None,
        doc="file of measured times, .csv or .parquet: column value (s), and signal (NAME@ACTOR) unless for all actors",
    )
    measure = Parameter(bool, False, doc="whether to measure and record execution times, and delay nothing")
    scale = Parameter(float, 1.0, min=0.0, unit="1", doc="factor by which the processor is slower than the given times")
    busy = Parameter(str, WAIT, choices=(WAIT, SKIP), doc="what happens to a firing that falls due during another one")

    def check(self) -> None:
        if self.measure and (self.time != 0.0 or self.times is not None):
            raise EpicycleError("it cannot measure execution times that are given; leave out 'measure', or the times")
        self._measured = None if self.times is None else _MeasuredTimes(self.times)

    def schedule(self, job: Job, point: ActorPoint) -> None:
        seconds = time_needed(self.time, job, point.random)
        if seconds is None:
            self._occupy(job, point, 0)
            return
        if self.measure:
            job.watch = point.record
            point.forward(job)
            return
        if self._measured is not None:
            number = point.memory["number"] = point.memory.get("number", -1) + 1
            seconds += self._measured.of(point.owner, number)
        self._occupy(job, point, to_nanoseconds(self.scale * seconds))

    def pass_by(self, job: Job, point: ActorPoint) -> None:
        self._occupy(job, point, 0)  # although it still waits for those before it

    def forget(self, point: ActorPoint) -> None:
        point.memory.pop("free", None)

    def _occupy(self, job: Job, point: ActorPoint, duration: int) -> None:
        now = point.tag.time
        free = max(now, point.memory.get("free", now))
        if free > now and duration > 0 and self.busy == SKIP and not job.wakes:
            point.act("skipped", None)
            return
        point.memory["free"] = free + duration
        if free + duration == now:
            point.forward(job)
            return
        delay = to_seconds(free + duration - now)
        point.act("delayed", delay)
        point.forward(job, delay)


class _MeasuredTimes:
    """A file of execution times (s): the signals of a run, or a table with a column ``value`` for all actors."""

    def __init__(self, file: Path) -> None:
        if file.suffix.lower() not in (".csv", ".parquet"):
            raise EpicycleError(f"times: {file.name!r} must end in .csv or .parquet")
        self.file = file

    def of(self, actor: str, number: int) -> float:
        """The time of an actor's firing with a number, from 0; raises ``EpicycleError``."""
        times = self._times.get("") or self._times.get(actor)
        if times is None:
            raise self._error(
                f"it has no times of {actor}{did_you_mean(actor, self._times)}; it has times of "
                f"{', '.join(self._times) or 'no actor'}"
            )
        return times[number % len(times)]

    @cached_property
    def _times(self) -> dict[str, list[float]]:
        """The times of each actor; under an empty name if they are for all."""
        try:
            table = read_table(self.file)
        except OSError as error:
            raise self._error(str(error.strerror)) from None
        if "value" not in table.column_names:
            raise self._error(f"it has no column 'value'; columns: {', '.join(table.column_names)}")
        values = table.column("value").to_pylist()
        is_for_all = "signal" not in table.column_names
        names = [""] * len(values) if is_for_all else map(str, table.column("signal").to_pylist())
        found: dict[str, list[float]] = {}
        for row, (name, value) in enumerate(zip(names, values, strict=True), 1):
            _, at, actor = name.partition("@")
            if not at and not is_for_all:
                continue  # another signal
            if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 <= value < float("inf"):
                raise self._error(f"row {row}: {value!r} is not a time in s >= 0")
            found.setdefault(actor, []).append(float(value))
        if is_for_all and not found:
            raise self._error("it has no rows")
        return found

    def _error(self, reason: str) -> EpicycleError:
        return EpicycleError(f"the execution times in {self.file} cannot be used: {reason}")


class SkipFiring(ExecutionAspect):
    """Skips each firing with a fixed probability, independently: its tokens are lost.

    An actor that requests its next wake-up in each firing would sleep for ever after a skipped one.  So a firing with a
    due wake-up always happens, unless ``wakes`` allows skipping it as well.
    Event: ``skipped``.
    """

    events: ClassVar[tuple[str, ...]] = ("skipped",)

    probability = Parameter(float, min=0.0, max=1.0, unit="1", doc="probability that a firing is skipped")
    wakes = Parameter(bool, False, doc="whether firings for a wake-up may also be skipped")

    def schedule(self, job: Job, point: ActorPoint) -> None:
        skipped = point.random.random() < self.probability
        if skipped and (self.wakes or not job.wakes):
            point.act("skipped", None)
        else:
            point.forward(job)


class Processor(ExecutionAspect):
    """One processor for all its actors: each of their firings needs it for some time.

    An actor fires when the processor has spent the time of its firing, with the tokens from the beginning. As in
    ``ExecutionTime``, tokens that are only stored cost no time, and times may be given by input port.  fcfs: firings go
    in the order in which they fell due.  priority: the actor with the smallest number goes first; actors without a
    number go last.  edf: the firing with the earliest deadline goes first.  Equals go in the order in which they fell
    due, by tag, and within a tag by the firing order of the model.  With ``preemptive``, a more urgent firing
    interrupts the running one, which later continues where it was; firings that fall due at the very instant at which
    another begins are always considered first.  Times are those of the model, whatever clocks the actors have.

    Events: ``delayed``, when it fires, with the seconds since it fell due (its response time); ``preempted``, with the
    seconds that it still needs; ``missed``, when it fires after its deadline, with the seconds that it is late.
    Reported: ``utilisation``, the share of the time from 0 to the end in which it is busy; ``mean_response`` and
    ``max_response`` over the firings that took place.

    For periodic tasks with fixed priorities the longest response R of a task is the least solution of
    R = C + sum over the more urgent ones of ceil(R / T_j) C_j (Joseph and Pandya, The Computer Journal 29, 1986); with
    edf no deadline is missed as long as the utilisation is at most 1 and deadlines are periods (Liu and Layland,
    Journal of the ACM 20, 1973).  Ptolemy: ``FCFSScheduler``, ``FixedPriorityScheduler``, ``EDFScheduler``.
    """

    events: ClassVar[tuple[str, ...]] = ("delayed", "preempted", "missed")
    reports: ClassVar[dict[str, str]] = {"utilisation": "1", "mean_response": "s", "max_response": "s"}
    in_model_time: ClassVar[bool] = True
    is_processor: ClassVar[bool] = True

    policy = Parameter(str, FCFS, choices=(FCFS, PRIORITY, EDF), doc="which of the due firings goes first")
    preemptive = Parameter(bool, True, doc="whether a more urgent firing interrupts the running one")
    time = FiringTimeParameter(
        0.0, doc="execution time of a firing, or a distribution, or {port: time}, for actors not named in times"
    )
    times = ByActorParameter(
        FiringTimeParameter(),
        words="times or distributions",
        doc="execution time of a firing (s), by actor: {pattern: time, distribution, or {port: time}}",
    )
    priorities = ByActorParameter(
        Parameter(float, unit="1"), doc="priority by actor, the smallest most urgent: {pattern: number}"
    )
    deadlines = ByActorParameter(
        Parameter(float, min=0.0, unit="s"),
        words="times",
        doc="deadline by actor, from when a firing falls due (s): {pattern: time}",
    )

    def schedule(self, job: Job, point: ActorPoint) -> None:
        given: FiringTime | None = self._of("times", point)
        seconds = time_needed(self.time if given is None else given, job, point.random)
        if seconds is None:
            self.pass_by(job, point)
        else:
            self._core(point).arrive(self._task(job, point, to_nanoseconds(seconds)), preemptive=self.preemptive)

    def pass_by(self, job: Job, point: ActorPoint) -> None:
        # It takes no time, but must stay after the earlier ones of its actor.
        core = self._core(point)
        if core.has_any(point):
            core.arrive(self._task(job, point, 0), preemptive=self.preemptive)
        else:
            point.forward(job)

    def forget(self, point: ActorPoint) -> None:
        self._core(point).remove(point)

    def report(self, shared: dict[Any, Any], end: int) -> dict[str, float | None]:
        core: Server = shared.get("core", Server())
        return {
            "utilisation": core.busy_until(end) / end if end else None,
            "mean_response": to_seconds(core.responses) / core.done if core.done else None,
            "max_response": to_seconds(core.longest) if core.done else None,
        }

    @staticmethod
    def _core(point: ActorPoint) -> Server:
        core: Server = point.shared.setdefault("core", Server())
        return core

    def _task(self, job: Job, point: ActorPoint, duration: int) -> _Firing:
        now, limit = point.tag.time, self._of("deadlines", point)
        deadline = float("inf") if limit is None else now + to_nanoseconds(limit)
        urgency = 0.0
        if self.policy == PRIORITY:
            priority = self._of("priorities", point)
            urgency = float("inf") if priority is None else priority
        elif self.policy == EDF:
            urgency = deadline
        return _Firing(urgency, job, point, duration, deadline)

    def _of(self, name: str, point: ActorPoint) -> Any:
        """The value of a parameter by actor for this one."""
        if name not in point.memory:
            point.memory[name] = ByActorParameter.of(getattr(self, name), point.selected(name), point.owner)
        return point.memory[name]


@dataclass(order=True)
class _Firing(Task):
    """A firing that needs the processor."""

    deadline: float = field(compare=False)

    def release(self, now: int) -> None:
        if now > self.came:
            self.point.act("delayed", to_seconds(now - self.came))
        if now > self.deadline:
            self.point.act("missed", to_seconds(now - round(self.deadline)))
        self.point.forward(self.passing)


class CrashRestart(ExecutionAspect):
    """Stops actors, and starts them again when they are repaired: at given times, at random, or both.

    Its target crashes as a whole: a composite with all the actors in it.  The time from a repair to the next failure is
    exponentially distributed with mean ``mtbf``; its availability, the share of time in which it works, is then mtbf /
    (mtbf + mean of ``repair``) in the long run.  Failures do not happen while the aspect is not active.  Times are
    those of the model.

    With the state ``lost``, actors lose their state, unfinished work and wake-ups.  After the repair they start again,
    as in ``initialize`` before the first tag; their random streams continue.  Leave out actors that represent physics,
    which does not crash with the software (``!robot.vehicle``).  With the state ``kept``, they continue where they
    were: unfinished work, and wake-ups that fell due meanwhile, are executed at once. A process that waits for an event
    of SimPy, such as a resource, is not delayed by a crash that keeps the state.  ``tokens`` that come meanwhile are
    lost, or kept until the repair.

    Events: ``crashed``; ``restarted``, with the seconds that it was down; ``skipped``, a firing whose tokens came while
    it was down.  Reported: ``availability``, over the time from 0 to the end of the run.  In a run without a stop time,
    random failures continue until ``until``, or without that for ever.
    """

    events: ClassVar[tuple[str, ...]] = ("crashed", "restarted", "skipped")
    reports: ClassVar[dict[str, str]] = {"availability": "1"}
    in_model_time: ClassVar[bool] = True

    times = array_parameter((None,), (), unit="s", min=0.0, doc="when it crashes")
    mtbf = Parameter(
        float,
        None,
        above=0,
        unit="s",
        doc="mean time from a repair to the next failure; no random failures if left out",
    )
    repair = DurationParameter(0.0, doc="how long it is down: a time or a distribution")
    state = Parameter(str, LOST, choices=(LOST, KEPT), doc="what happens to the actors' state")
    tokens = Parameter(str, LOST, choices=(LOST, KEPT), doc="what happens to tokens that come while it is down")

    def begin(self, target: Target) -> None:
        target.memory["life"] = life = _Life()
        target.shared.setdefault("units", []).append(life)
        now = target.tag.time
        for time in sorted(to_nanoseconds(float(each)) for each in self.times):
            if time > now:
                target.later(to_seconds(time - now), self._crash, target)
            else:
                self._crash(target)
        if life.since is None:  # otherwise after the repair
            self._await_failure(target)

    def schedule(self, job: Job, point: ActorPoint) -> None:
        point.forward(job)  # while it is down, no jobs come here

    def report(self, shared: dict[Any, Any], end: int) -> dict[str, float | None]:
        lives: list[_Life] = shared.get("units", [])
        down = sum(life.down_until(end) for life in lives)
        return {"availability": 1.0 - down / (end * len(lives)) if end and lives else None}

    def _await_failure(self, target: Target) -> None:
        is_over = self.until is not None and self.every is None and target.now >= self.until
        if self.mtbf is not None and not is_over:
            life: _Life = target.memory["life"]
            target.later(target.random.exponential(self.mtbf), self._fail, (target, life.crashes))

    def _fail(self, what: tuple[Target, int]) -> None:
        """A random failure, unless a crash at a given time came before it."""
        target, crashes = what
        life: _Life = target.memory["life"]
        if life.crashes == crashes:
            self._crash(target)
            if life.crashes == crashes:
                self._await_failure(target)

    def _crash(self, target: Target) -> None:
        """Let it crash, if it can crash now."""
        life: _Life = target.memory["life"]
        is_active = self.is_due(target.tag.time) and (self.when is None or bool(target.value_of(self.when)))
        if life.since is not None or not is_active:
            return
        life.crashes += 1
        life.since = target.tag.time
        target.act("crashed", None)
        if self.state == LOST:
            target.kill()
        target.suspend(self._keeps)
        target.later(drawn(self.repair, target.random), self._restart, target)

    def _keeps(self, job: Job, point: ActorPoint) -> bool:
        """Whether a job that falls due while it is down waits for the repair; wake-ups always do."""
        if self.tokens == LOST and job.arrivals:
            point.act("skipped", None)
            job.arrivals.clear()
        return job.is_wanted

    def _restart(self, target: Target) -> None:
        life: _Life = target.memory["life"]
        down = life.down_until(target.tag.time)
        target.act("restarted", to_seconds(down - life.down))
        life.down, life.since = down, None
        if self.state == LOST:
            target.restart()
        target.resume()
        self._await_failure(target)


@dataclass
class _Life:
    """The history of one target; times in ns."""

    crashes: int = 0
    down: int = 0  # before the crash not yet repaired
    since: int | None = None  # the time of that crash

    def down_until(self, end: int) -> int:
        """How long it was down in total before ``end``, which is not before the present."""
        return self.down + (0 if self.since is None else end - self.since)
