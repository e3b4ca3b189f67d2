"""The errors that end a run: an actor that fails, time that stands still, too much at one tag."""

from __future__ import annotations

from collections.abc import Iterable

from epicycle.actors import Actor, EpicycleError, Process, Tag, readable

from ...model.text.limits import RAISE_IT
from ...model.text.problems import Position, told_raised
from ...model.text.program import describe

MAX_MICROSTEPS = 100_000
MAX_STEPS = 1_000_000  # of SimPy at one instant
SHOWN = 3  # ports in the message of a ``CrowdError``


class ActorError(EpicycleError):
    """An actor raised an exception: names it and the tag; the exception itself is the cause.

    ``where`` is where the actor is declared, ``raised`` the line of a user's program from which the exception comes.
    """

    def __init__(
        self, path: str, tag: Tag, doing: str, reason: str, where: str = "", raised: Position | None = None
    ) -> None:
        super().__init__(path, tag, doing, reason, where, raised)
        self.path = path
        self.tag = tag
        self.doing = doing
        self.reason = reason
        self.where = where
        self.raised = raised

    def __str__(self) -> str:
        lines = [readable(f"{self.path} failed in {self.doing} at {self.tag}: {self.reason}")]
        lines += told_raised(self.raised) if self.raised is not None else []
        lines += [f"   declared at {self.where}"] if self.where else []
        return "\n".join(lines)


class LoopError(EpicycleError):
    """Time stands still: too many microsteps, or too many SimPy events, at one instant."""

    def __init__(self, time: int, actors: tuple[str, ...]) -> None:
        super().__init__(time, actors)
        self.time = time
        self.actors = actors

    def __str__(self) -> str:
        head = f"time stands still at {self.time / 1e9:g} s: more than "
        if not self.actors:
            return head + f"{MAX_STEPS:,} SimPy events; a process keeps waiting for zero time"
        names = ", ".join(self.actors)
        return head + (
            f"{MAX_MICROSTEPS:,} microsteps; the last actors that fired: {names}; give their loop a delay above zero"
        )


class CrowdError(LoopError):
    """More at one tag, or still to come, than the limit; ``where`` are the ports with most of it."""

    def __init__(self, tag: Tag, most: int, what: str, where: tuple[str, ...]) -> None:
        super().__init__(tag.time, where)
        self.args = (tag, most, what, where)
        self.tag, self.most, self.what, self.where = self.args

    def of(self, who: str) -> CrowdError:
        """The same, with the name of the part that adds to it."""
        return CrowdError(self.tag, self.most, self.what, (who,))

    def __str__(self) -> str:
        where = f", most of them at {', '.join(self.where)}" if self.where else ""
        return readable(f"too much at {self.tag}: more than {self.most:,} {self.what}{where}; {RAISE_IT}")


class Crowd:
    """Counts the contents of a tag when there are many: those who add to it report many at a time."""

    def __init__(self, most: int) -> None:
        self.most = most
        self._tag: Tag | None = None
        self._total = 0
        self._by_port: dict[str, int] = {}

    def add(self, tag: Tag, port: str, number: int) -> None:
        """Count more at a port; raises ``CrowdError``."""
        if tag != self._tag:
            self._tag, self._total, self._by_port = tag, 0, {}
        self._total += number
        self._by_port[port] = self._by_port.get(port, 0) + number
        if self._total > self.most:
            ports = sorted(self._by_port, key=self._by_port.__getitem__, reverse=True)
            raise CrowdError(tag, self.most, "tokens and events of aspects", tuple(ports[:SHOWN]))


def of_process(error: BaseException, actors: Iterable[Actor], tag: Tag) -> tuple[ActorError, BaseException | None]:
    """The error of a process that SimPy resumed, and its cause: no firing says whose error it is."""
    for actor in actors:
        failure = actor.failure if isinstance(actor, Process) else None
        if isinstance(failure, ActorError):  # of an aspect or a metric that the process has sent to
            return failure, failure.__cause__
        if failure is not None:
            return ActorError(actor.path, tag, "run()", describe(failure)), failure
    cause = error.__cause__ or error  # SimPy raises a copy of it
    return ActorError("a SimPy process", tag, "its generator", describe(cause)), cause
