"""Execution: how an actor with aspects fires.

The director does not fire such an actor: in its activations a stand-in fires, which turns the tokens and wake-ups of
the firing into a ``Job`` and passes it to the aspects.  When they let it pass, the actor fires for it, in an activation
at its own rank, so that what it sends is received within the tag. A job that passes at once is a firing like any
other. All other actors fire as in a model without such aspects.
"""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter
from typing import Any

from epicycle.actors import Actor, InputPort, Tag, Wake
from epicycle.aspects import ActorPoint, Job

from ...model.text.program import describe
from .agenda import Activation
from .director import Director
from .errors import ActorError
from .local_time import LocalDirector
from .refinement import Refinement


class Execution:
    """The execution of one actor, and its context: its requests to the director are made for its stand-in.

    ``way`` is the way of its jobs, which leads to ``execute``; each of ``refresh`` is called before the actor fires,
    and ``forget`` when it has lost its state.
    """

    def __init__(self, actor: Actor, director: Director, local: Director | LocalDirector | Refinement) -> None:
        self.actor = actor
        self.way: Callable[[Job], None] = self.execute
        self.refresh: list[Callable[[], None]] = []
        self.forget: Callable[[], None] = _nothing
        self.resumed: Callable[[], None] | None = None  # called before a firing that was deferred from outside
        self.refinement: Refinement | None = None  # its refinement, if errors in it lead to a transition
        self.seed = director.seed
        self.streams = director.streams
        self.environment = local.environment
        self.stop = local.stop
        self._director = director
        self._local = local
        # An actor has an activation for each rank at which it takes tokens, and one for its wake-ups.
        self._turns: dict[int, _StandIn] = {}
        for port in actor.inputs.values():
            self._stand_in(director.ranks[port.path])
        self._own = self._stand_in(director.ranks[actor.path])
        for rank, activation in self._turns.items():
            activation.inputs.update({port.name: port for port in director.inputs_at(actor, rank)})
        self._open: int | None = None  # the rank of its activation, while the actor itself is idle
        self._asked: list[Wake] = []  # wake-ups that are to come
        self._ready: dict[Wake, Job] = {}  # jobs to execute, and by when
        self._life = 0  # how often it has been killed
        # While it is suspended: by whom, the jobs to execute, and those that have fallen due.
        self._gates: dict[ActorPoint, Callable[[Job, ActorPoint], bool]] = {}
        self._held: list[Job] = []
        self._waiting: list[Job] = []

    def _stand_in(self, rank: int) -> _StandIn:
        if rank not in self._turns:
            self._turns[rank] = _StandIn(self, rank)
        return self._turns[rank]

    def turn_at(self, rank: int) -> Activation:
        """An activation as the actor itself would have it."""
        return self._director.new_activation(self.actor, rank)

    # -- as the actor's context -----------------------------------------------------------------------------------

    @property
    def tag(self) -> Tag:
        """The present tag."""
        return self._local.tag

    @property
    def time(self) -> int:
        """Its time (ns)."""
        return self._local.time

    def wake(self, actor: Actor, time: int) -> Wake:
        """Give the actor an activation at ``time``."""
        wake = self._local.wake(self._own, time)
        self._asked.append(wake)
        return wake

    # -- its activations ----------------------------------------------------------------------------------------------

    def activation_of(self, port: InputPort[Any]) -> Actor:
        """The stand-in that fires for a token at a port."""
        return self._turns[self._director.ranks[port.path]]

    def take(self, activation: _StandIn) -> None:
        """Use an activation: execute what is ready, and pass what has fallen due to the aspects."""
        self._director.firings -= 1  # the actor counts its own firings, and an activation is not one
        job = self._fallen_due(activation)
        ready = [wake for wake, each in self._ready.items() if wake.due and each.rank == activation.rank]
        self._open = activation.rank
        try:
            for wake in ready:
                self._carry_out(self._ready.pop(wake))
            if job.is_wanted:
                self._offer(job)
        finally:
            self._open = None

    def _fallen_due(self, activation: _StandIn) -> Job:
        """Take the tokens out of the ports and the wake-ups back, as if they had not yet come."""
        due = [wake for wake in self._asked if wake.due] if activation is self._own else []
        if self._asked:
            self._asked = [wake for wake in self._asked if not (wake.due or wake.cancelled)]
        for wake in due:
            wake.due = False
        taken = {port: port.take() for port in activation.inputs.values() if port.has_new}
        job = Job(self.actor, activation.rank, self._director.last, taken, tuple(due), life=self._life)
        self._director.set_aside(job)
        return job

    def _offer(self, job: Job) -> None:
        if not self._gates:
            self.way(job)
            return
        kept = [keeps(job, point) for point, keeps in self._gates.items()]  # all of them are notified
        if all(kept):
            self._waiting.append(job)

    def execute(self, job: Job) -> None:
        """Let the actor fire for a job: at once if it is its activation, or else in its next possible one."""
        if self._open == job.rank:
            self._carry_out(job)
            return
        tag = self._director.next_tag(job.rank)
        self._ready[self._director.call(self._turns[job.rank], tag, job.rank)] = job

    def _carry_out(self, job: Job) -> None:
        if job.life != self._life or not job.is_wanted:
            return
        if self.refinement is not None and not self.refinement.is_open:
            return
        if self._gates:
            self._held.append(job)
            return
        if self.resumed is not None and job.released != self._director.last:
            self.resumed()
        self._director.put_back(job)
        for wake in job.wakes:
            wake.due = not wake.cancelled
        for port, taken in job.arrivals.items():
            port.give(taken)
        for refresh in self.refresh:
            refresh()
        activation, self._open = self._open, None
        start = perf_counter()
        own = self._turns[job.rank].of_actor
        try:
            try:
                self._director.fire(own)
            except BaseException as error:
                self._director.fail(own, error)
            finally:
                own.clear()  # the director clears only the activation of the stand-in
        except ActorError as error:
            if self.refinement is None:
                raise
            self.refinement.mode_director.fail(error)
        if job.watch is not None:
            job.watch(perf_counter() - start)
        self._open = activation

    # -- acts of aspects on the actor as a whole ------------------------------------------------------------------

    def suspend(self, point: ActorPoint, keeps: Callable[[Job, ActorPoint], bool]) -> None:
        """Keep the actor from firing until ``resume``; ``keeps`` says whether a job that falls due meanwhile waits."""
        self._gates[point] = keeps

    def resume(self, point: ActorPoint) -> None:
        """Let the actor fire again: first for the jobs to execute meanwhile, then for those that fell due."""
        del self._gates[point]
        if self._gates:
            return
        held, waiting = self._held, self._waiting
        self._held, self._waiting = [], []
        for job in held:
            self.execute(job)
        for job in waiting:
            self.way(job)

    def kill(self) -> None:
        """Cancel the actor's wake-ups and drop its jobs."""
        self._life += 1
        for wake in self._asked:
            wake.cancel()
        self._asked = []
        self._call(self.actor.halt, "halt()")
        self.forget()

    def restart(self) -> None:
        """Restart the actor."""
        self._call(self.actor.restart, "restart()")

    def _call(self, method: Callable[[], None], name: str) -> None:
        try:
            method()
        except Exception as error:
            raise ActorError(self.actor.path, self._director.tag, name, describe(error)) from error


class _StandIn(Actor):
    """Fires in place of an actor, in its activations at one rank, for the tokens taken there."""

    def __init__(self, execution: Execution, rank: int) -> None:
        super().__init__(execution.actor.path)
        self.rank = rank
        self._execution = execution
        self._of_actor: Activation | None = None

    @property
    def of_actor(self) -> Activation:
        """The activation as the actor itself would have it."""
        if self._of_actor is None:
            self._of_actor = self._execution.turn_at(self.rank)
        return self._of_actor

    def fire(self) -> None:
        self._execution.take(self)


def is_stand_in(actor: Actor) -> bool:
    """Whether this is a stand-in, not an actor."""
    return isinstance(actor, _StandIn)


def _nothing() -> None:
    pass
