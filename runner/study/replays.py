"""Runs once more, for their signals: a study keeps none, as a run repeats bit for bit."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from typing import Any, Protocol

from epicycle.actors import EpicycleError

from ..engine import Results, Simulation
from ..model import Model
from .local import one_thread, process_context
from .plan import Plan


class ReplayError(EpicycleError):
    """A run that cannot be repeated, or does not give what it gave before."""


class Reader(Protocol):
    """What is wanted of a repeated run; has to be picklable."""

    def ports(self, model: Model) -> tuple[str, ...]:
        """The output ports to be recorded, as patterns."""

    def extract(self, model: Model, results: Results) -> Any:
        """What is kept, as plain data."""


@dataclass(frozen=True)
class Replay:
    """A run that is to be repeated, and who reads it, by name."""

    condition: int
    replication: int
    seed: int
    digest: str
    readers: tuple[tuple[str, Reader], ...]


def repeat(
    plan: Plan, replays: Sequence[Replay], jobs: int, tell: Callable[[int], None] = lambda done: None
) -> Iterator[tuple[Replay, dict[str, Any]]]:
    """Repeat runs in ``jobs`` processes, in any order: each with what its readers took of it.

    What a reader raises stands in the place of what it took, as an ``EpicycleError``.  Raises ``ReplayError``.
    """
    if not replays:
        return
    # Runs of one condition follow each other, so that a process loads few models.
    ordered = sorted(replays, key=lambda each: (each.condition, each.replication))
    with (
        one_thread(),
        ProcessPoolExecutor(min(jobs, len(ordered)), process_context(), _begin, (plan.manifest(),)) as pool,
    ):
        futures = {pool.submit(_repeated, each): each for each in ordered}
        try:
            for done, future in enumerate(as_completed(futures), start=1):
                yield futures[future], future.result()
                tell(done)
        except BrokenProcessPool:
            raise ReplayError("a process that repeated runs has died; is there enough memory?") from None
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


_PLAN: list[Plan] = []  # of this process
_LOADED: dict[int, Model] = {}


def _begin(manifest: dict[str, Any]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who waits for it decides what an interrupt means
    sys.stdout = open(os.devnull, "w")  # noqa: SIM115  of actors that print
    _PLAN[:] = [Plan.of_manifest(manifest)]


def _repeated(replay: Replay) -> dict[str, Any]:
    plan = _PLAN[0]
    if replay.condition not in _LOADED:
        _LOADED.clear()
        _LOADED[replay.condition] = plan.load(plan.condition(replay.condition))
    model = _LOADED[replay.condition]
    found: dict[str, Any] = {}
    model.recorded = []
    for _, reader in replay.readers:
        model.record(*reader.ports(model))
    results = Simulation(model, seed=replay.seed).run()
    if results.digest != replay.digest:
        raise ReplayError(
            f"run {replay.replication} of condition {replay.condition} (seed {replay.seed}) does not repeat: "
            f"its digest is {results.digest[:16]}..., but was {replay.digest[:16]}...; something has changed since"
        )
    for name, reader in replay.readers:
        try:
            found[name] = reader.extract(model, results)
        except EpicycleError as error:
            found[name] = EpicycleError(str(error))
    return found
