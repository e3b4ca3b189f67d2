"""Runs once more, for their signals: a study keeps none, as a run repeats bit for bit."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Protocol

from epicycle.actors import EpicycleError

from ...build import Model
from ...engine import Results, Simulation
from ..plan import Plan
from .processes import DONE, Processes


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
    # Runs of one condition follow each other, so that a process loads few models.
    ordered = sorted(replays, key=lambda each: (each.condition, each.replication))
    with ThreadPoolExecutor(jobs) as threads, Processes(_Repeater, plan.manifest()) as processes:
        futures = {threads.submit(processes.make, each): each for each in ordered}
        for done, future in enumerate(as_completed(futures), start=1):
            what, found = future.result()
            if what != DONE:
                raise ReplayError("a process that repeated runs has died; is there enough memory?")
            yield futures[future], found
            tell(done)


class _Repeater:
    """Repeats runs of a plan."""

    def __init__(self, manifest: Mapping[str, Any]) -> None:
        self._plan = Plan.of_manifest(manifest)
        self._model = lru_cache(1)(lambda index: self._plan.load(self._plan.condition(index)))

    def prepare(self, replay: Replay) -> None:
        """Load the model."""
        self._model(replay.condition)

    def make(self, replay: Replay) -> dict[str, Any]:
        """What the readers take of the run."""
        model = self._model(replay.condition)
        model.recorded = []
        for _, reader in replay.readers:
            model.record(*reader.ports(model))
        results = Simulation(model, seed=replay.seed).run()
        if results.digest != replay.digest:
            raise ReplayError(
                f"run {replay.replication} of condition {replay.condition} (seed {replay.seed}) does not repeat: "
                f"its digest is {results.digest[:16]}..., but was {replay.digest[:16]}...; something has changed since"
            )
        found: dict[str, Any] = {}
        for name, reader in replay.readers:
            try:
                found[name] = reader.extract(model, results)
            except EpicycleError as error:
                found[name] = EpicycleError(str(error))
        return found
