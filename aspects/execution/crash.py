"""Crashes: actors that stop, and start again later."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from epicycle.actors import Parameter, array_parameter, to_nanoseconds, to_seconds

from ..core import ActorPoint, DurationParameter, ExecutionAspect, Job, Unit, drawn

LOST, KEPT = "lost", "kept"


class CrashRestart(ExecutionAspect):
    """Stops actors, and starts them again when they are repaired: at given times, or at random, or both.

    What it is aimed at crashes as a whole: a composite with all the actors in it.  The time from a repair to the next
    failure is exponentially distributed with mean ``mtbf``; the share of time in which it works, its availability, is
    then mtbf / (mtbf + mean of ``repair``) in the long run.  A failure that falls into a time at which the aspect is
    not active does not happen.  Times are those of the model.

    With the state ``lost`` everything is gone that the actors knew and had begun, their wake-ups included, and after
    the repair they begin anew, as in ``initialize`` before the first tag; their random streams go on.  Actors that
    stand for physics, which does not crash with the software, are better left out (``!robot.vehicle``).  With the state
    ``kept`` they go on where they were: what had begun, and wake-ups that fell due meanwhile, are executed at once.
    A process that waits for an event of SimPy's own, such as a resource, is not held up by a crash that keeps the
    state.  ``tokens`` that come meanwhile are lost, or kept until the repair.

    Events: ``crashed``; ``restarted``, with the seconds that it was down; ``skipped``, a firing for whose tokens nobody
    was there.  Reported: ``availability``, over the time from 0 to the end of the run.  In a run that has no stop time
    random failures go on until ``until``, and without that for ever.
    """

    events: ClassVar[tuple[str, ...]] = ("crashed", "restarted", "skipped")
    reports: ClassVar[dict[str, str]] = {"availability": "1"}
    in_model_time: ClassVar[bool] = True

    times = array_parameter((None,), (), unit="s", min=0.0, doc="when it crashes")
    mtbf: Parameter[float | None] = Parameter(
        float, None, above=0, unit="s", doc="mean time from a repair to the next failure; none: no random failures"
    )
    repair = DurationParameter(0.0, doc="how long it is down: a time or a distribution")
    state = Parameter(str, LOST, choices=(LOST, KEPT), doc="what becomes of the actors' state")
    tokens = Parameter(str, LOST, choices=(LOST, KEPT), doc="what becomes of tokens that come while it is down")

    def begin(self, unit: Unit) -> None:
        unit.memory["life"] = life = _Life()
        unit.shared.setdefault("units", []).append(life)
        now = unit.tag.time
        for time in sorted(to_nanoseconds(float(each)) for each in self.times):
            if time > now:
                unit.later(to_seconds(time - now), self._crash_at, unit)
            else:
                self._crash(unit)
        self._await_failure(unit)

    def schedule(self, job: Job, point: ActorPoint) -> None:
        point.forward(job)  # while it is down, jobs do not come here

    def report(self, shared: dict[Any, Any], end: int) -> dict[str, float | None]:
        lives: list[_Life] = shared.get("units", [])
        down = sum(life.down_until(end) for life in lives)
        return {"availability": 1.0 - down / (end * len(lives)) if end and lives else None}

    def _await_failure(self, unit: Unit) -> None:
        is_over = self.until is not None and self.every is None and unit.now >= self.until
        if self.mtbf is not None and not is_over:
            life: _Life = unit.memory["life"]
            unit.later(unit.random.exponential(self.mtbf), self._fail, (unit, life.crashes))

    def _fail(self, what: tuple[Unit, int]) -> None:
        """A random failure, unless a crash at a given time came before it."""
        unit, crashes = what
        if unit.memory["life"].crashes == crashes and not self._crash(unit):
            self._await_failure(unit)

    def _crash_at(self, unit: Unit) -> None:
        self._crash(unit)

    def _crash(self, unit: Unit) -> bool:
        """Let it crash, if that can be now; whether it does."""
        life: _Life = unit.memory["life"]
        is_active = self.is_due(unit.tag.time) and (self.when is None or bool(unit.value_of(self.when)))
        if life.since is not None or not is_active:
            return False
        life.crashes += 1
        life.since = unit.tag.time
        unit.act("crashed", None)
        if self.state == LOST:
            unit.kill()
        unit.suspend(self._keeps)
        unit.later(drawn(self.repair, unit.random), self._restart, unit)
        return True

    def _keeps(self, job: Job, point: ActorPoint) -> bool:
        """Whether a job that falls due while it is down waits for the repair; wake-ups always do."""
        if self.tokens == LOST and job.arrivals:
            point.act("skipped", None)
            job.arrivals.clear()
        return job.is_wanted

    def _restart(self, unit: Unit) -> None:
        life: _Life = unit.memory["life"]
        down = life.down_until(unit.tag.time)
        unit.act("restarted", to_seconds(down - life.down))
        life.down, life.since = down, None
        if self.state == LOST:
            unit.restart()
        unit.resume()
        self._await_failure(unit)


@dataclass
class _Life:
    """How one unit has fared; times in ns."""

    crashes: int = 0
    down: int = 0  # before the crash that is not repaired
    since: int | None = None  # when that was

    def down_until(self, end: int) -> int:
        """How long it was down in all, before ``end``, which is not before the present."""
        return self.down + (0 if self.since is None else end - self.since)
