"""Execution: the directors of models that have aspects at actors.

Such an actor does not fire when it is its turn: the tokens and wake-ups of the firing become a ``Job``, and the aspects
decide when it is executed.  It is executed in a turn of the actor, that is at the rank at which it would have fired, so
that what it sends is received within the tag.  A job that is let pass at once is a firing as any other.
"""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter
from typing import Any

from epicycle.actors import Actor, Tag, Wake
from epicycle.aspects import ActorPoint, Job

from .director import ActorError, Director, describe
from .trace import Arrival, Tracer, TracingDirector

Turn = tuple[int, int, int]  # time (ns), microstep, rank


class ExecutingDirector(Director):
    """A director that hands the firings of some actors to aspects."""

    def __init__(self, order: dict[str, int], seed: int, *more: Any) -> None:
        super().__init__(order, seed, *more)
        self._ways: dict[Actor, Callable[[Job], None]] = {}
        self._refresh: dict[Actor, list[Callable[[], None]]] = {}
        self._ready: dict[Turn, list[Job]] = {}  # what is to be executed in a turn
        self._wakes_due: list[Wake] = []
        self._turn: Turn = (0, 0, 0)  # the latest one
        self._open: tuple[Actor, int] | None = None  # whose turn it is, while the actor itself does nothing
        # Of the actors that are suspended: by whom, what is to be executed, and what has fallen due.
        self._gates: dict[Actor, dict[ActorPoint, Callable[[Job, ActorPoint], bool]]] = {}
        self._held: dict[Actor, list[Job]] = {}
        self._waiting: dict[Actor, list[Job]] = {}
        self._forget: dict[Actor, Callable[[], None]] = {}
        self._lives: dict[Actor, int] = {}  # how often each has been killed

    def weave(self, actor: Actor, way: Callable[[Job], None], forget: Callable[[], None]) -> None:
        """Hand the jobs of an actor to aspects, behind which ``execute`` stands; ``forget`` tells them of a crash."""
        self._ways[actor] = way
        self._forget[actor] = forget
        self._lives[actor] = 0

    def suspend(self, point: ActorPoint, keeps: Callable[[Job, ActorPoint], bool]) -> None:
        """Let an actor not fire until ``resume``; ``keeps`` says whether a job that falls due meanwhile waits."""
        gates = self._gates.setdefault(point.actor, {})
        gates[point] = keeps

    def resume(self, point: ActorPoint) -> None:
        """Let an actor fire again: first for what it was to do meanwhile, then for what fell due."""
        actor, gates = point.actor, self._gates[point.actor]
        del gates[point]
        if gates:
            return
        del self._gates[actor]
        for job in self._held.pop(actor, ()):
            self.execute(job)
        for job in self._waiting.pop(actor, ()):
            self._ways[actor](job)

    def kill(self, actor: Actor) -> None:
        """Cancel an actor's wake-ups and drop its jobs."""
        self._lives[actor] += 1
        own = self._rank[actor.path]
        for (_, _, rank), wakes in self._wakes.items():
            for wake in wakes if rank == own else ():
                wake.cancel()
        actor.halt()
        self._forget[actor]()

    def restart(self, actor: Actor) -> None:
        """Let an actor begin anew."""
        try:
            actor.restart()
        except Exception as error:
            raise ActorError(actor.path, self.tag, "restart()", describe(error)) from error

    def refresh(self, actor: Actor, refresh: Callable[[], None]) -> None:
        """Call something before each firing of an actor, when that happens."""
        self._refresh.setdefault(actor, []).append(refresh)

    def execute(self, job: Job) -> None:
        """Let the actor fire for a job: at once if it is its turn, or else in the next turn that it can have."""
        if self._open == (job.actor, job.rank):
            self._execute(job)
            return
        tag = self.tag
        if self._firing and self._turn >= (tag.time, tag.microstep, job.rank):
            tag = Tag(tag.time, tag.microstep + 1)
        turn = self._want(job.actor, tag, job.rank)
        self._ready.setdefault(turn, []).append(job)

    def _is_idle(self, actor: Actor, key: Turn, rank: int) -> bool:
        wakes = self._wakes.get(key, [])
        idle = super()._is_idle(actor, key, rank)
        self._wakes_due = [wake for wake in wakes if wake.due]
        return idle and key not in self._ready

    def _fire(self, actor: Actor, rank: int) -> None:
        self._turn = turn = (self.last.time, self.last.microstep, rank)
        way = self._ways.get(actor)
        if way is None:
            for refresh in self._refresh.get(actor, ()):
                refresh()
            super()._fire(actor, rank)
            return
        job = self._take(actor, rank)
        self._open = (actor, rank)
        try:
            for each in self._ready.pop(turn, ()):
                self._execute(each)
            if not job.is_wanted:
                return
            gates = self._gates.get(actor)
            if gates is None:
                way(job)
                return
            kept = [keeps(job, point) for point, keeps in gates.items()]  # all of them are told
            if all(kept):
                self._waiting.setdefault(actor, []).append(job)
        finally:
            self._open = None

    def _take(self, actor: Actor, rank: int) -> Job:
        """Take the tokens out of the ports and the wake-ups back, as if they had not come yet."""
        later = self._later_ports.get(rank, ())
        ports = [port for port in actor.inputs.values() if port.present and port not in later]
        for wake in self._wakes_due:
            wake.due = False
        taken = {port: port.take() for port in ports}
        return Job(actor, rank, self.last, taken, tuple(self._wakes_due), life=self._lives[actor])

    def _execute(self, job: Job) -> None:
        if job.life != self._lives[job.actor] or not job.is_wanted:
            return
        if job.actor in self._gates:
            self._held.setdefault(job.actor, []).append(job)
        else:
            self._release(job)

    def _release(self, job: Job) -> None:
        """Put everything back, and let the actor fire."""
        for wake in job.wakes:
            wake.due = not wake.cancelled
        for port, taken in job.arrivals.items():
            port.give(taken)
        for refresh in self._refresh.get(job.actor, ()):
            refresh()
        turn, self._open = self._open, None
        start = perf_counter()
        super()._fire(job.actor, job.rank)
        if job.watch is not None:
            job.watch(perf_counter() - start)
        self._open = turn


class ExecutingTracingDirector(ExecutingDirector, TracingDirector):
    """Both: what a job was released for is told when it is executed."""

    def __init__(self, order: dict[str, int], seed: int, tracer: Tracer) -> None:
        super().__init__(order, seed, tracer)
        self._causes: dict[Job, tuple[list[Arrival], list[Tag | None]]] = {}

    def _take(self, actor: Actor, rank: int) -> Job:
        job = super()._take(actor, rank)
        taken = {port.name for port in job.arrivals}
        waiting = self._arrivals.pop(actor.path, [])
        self._arrivals[actor.path] = [arrival for arrival in waiting if arrival.port not in taken]
        self._causes[job] = [arrival for arrival in waiting if arrival.port in taken], self._due
        return job

    def _release(self, job: Job) -> None:
        arrivals, self._due = self._causes.pop(job)
        self._arrivals[job.actor.path] = [*arrivals, *self._arrivals.get(job.actor.path, [])]
        super()._release(job)


def director_for(order: dict[str, int], seed: int, tracer: Tracer | None, *, executing: bool) -> Director:
    """The simplest director that will do: one that traces if there is a tracer, one for aspects at actors if told."""
    if tracer is None:
        return ExecutingDirector(order, seed) if executing else Director(order, seed)
    return ExecutingTracingDirector(order, seed, tracer) if executing else TracingDirector(order, seed, tracer)
