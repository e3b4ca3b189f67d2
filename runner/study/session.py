"""A session of a study: what is not there yet is made, and what there is then is told."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from epicycle.actors import EpicycleError, counted

from ..engine import Simulation
from ..provenance import git_revision, machine, versions
from .judge import StudyResults
from .plan import Plan, epicycle_version
from .run import (
    FORMAT,
    LOCAL,
    RETRIED,
    Backlog,
    StoreError,
    check_executor,
    duration,
    lock,
    make_runs,
    prepare,
    read_manifest,
)

MANY = 100_000  # runs that nobody asks for by mistake
_TRIAL = 5.0  # s that are spent at most to find out how long a run takes


class TooManyRunsError(EpicycleError):
    """A study that is larger than its author may think."""


@dataclass
class Outcome:
    """What a session has done: runs by status, those that it made and those that were there."""

    made: int
    there: int
    failed: int  # of both
    stopped_early: int
    table: Path

    @property
    def is_good(self) -> bool:
        """Whether all runs are ok."""
        return self.failed == 0


def run_study(
    plan: Plan,
    folder: Path,
    *,
    jobs: int | None = None,
    timeout: float | None = None,
    retry: bool = False,
    tell: Callable[[Backlog], None] | None = None,
    executor: str = LOCAL,
    scheduler: str | None = None,
) -> Outcome:
    """Make all runs of a plan that are not in the folder yet.

    ``retry``: also those that took too long or whose process died.  ``executor``: ``local``, or ``dask`` for the
    workers of the Dask ``scheduler`` at that address, or for a cluster of its own on this machine.  Raises
    ``StoreError`` and ``WorkerError``, and ``EpicycleError`` where Dask is wanted and not installed.
    """
    check_executor(executor)  # before anything is written
    with lock(folder):
        store = prepare(folder, manifest_of(plan))
        known = store.known(plan.decides)
        backlog = Backlog(plan, {key: done for key, done in known.items() if not (retry and done.status in RETRIED)})
        make_runs(
            store,
            backlog,
            lambda: None if tell is None else tell(backlog),
            jobs=jobs or available_cores(),
            timeout=timeout,
            executor=executor,
            scheduler=scheduler,
        )
        table = StudyResults(folder).write_table()
        made, there = backlog.made.total(), backlog.there.total()
        return Outcome(made, there, backlog.failed, backlog.stopped_early, table)


def manifest_of(plan: Plan) -> dict[str, Any]:
    """All that the folder is to know: the plan, and what its results are made with."""
    study = plan.study
    return {
        "format": FORMAT,
        **plan.manifest(),
        "versions": versions(),
        "machine": machine(),
        "git": git_revision(study.path.resolve().parent),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def plan_of_folder(folder: Path) -> Plan:
    """The plan of a results folder that is to be resumed.

    Raises ``StoreError`` if its model, or Epicycle, is not the same any more.
    """
    manifest = read_manifest(folder)
    before = Plan.of_manifest(manifest)
    if (version := epicycle_version()) != before.made_with:
        raise StoreError(
            f"{folder} was made with Epicycle {before.made_with}, and this is Epicycle {version}\n"
            f"   help: install that one, or make all runs anew: 'epicycle study {before.study.path} --out ANOTHER'"
        )
    plan = Plan.made(before.study)
    if changed := sorted(name for name, digest in plan.sources.items() if before.sources.get(name) != digest):
        raise StoreError(
            f"the model has changed since {folder} was made: {', '.join(changed)}\n"
            f"   help: 'epicycle study {before.study.path} --out {folder}' makes the runs of the changed model"
        )
    return plan


def available_cores() -> int:
    """How many processes can run at once."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def check_size(plan: Plan, jobs: int) -> None:
    """Raise ``TooManyRunsError`` for a study of very many runs, with how long it would take."""
    if plan.size <= MANY:
        return
    seconds = seconds_of_a_run(plan) * plan.size / jobs
    raise TooManyRunsError(
        f"{plan.study.name} has {plan.conditions:,} conditions of {counted(plan.replications, 'replication')}: "
        f"{plan.size:,} runs, which take about {duration(seconds)} with {jobs} at a time\n"
        "   help: add --yes if that is what you want"
    )


class _Enough(Exception):  # noqa: N818  it is no error
    pass


def seconds_of_a_run(plan: Plan) -> float:
    """How long the first run takes, or seems to take after a few seconds of it."""
    condition = plan.condition(0)
    model = plan.load(condition)
    started = time.perf_counter()
    reached = 0.0

    def watch(now: float) -> None:
        nonlocal reached
        reached = now
        if time.perf_counter() - started > _TRIAL:
            raise _Enough

    try:
        Simulation(model, seed=plan.seed(condition, 0)).run(progress=watch)
    except _Enough:
        if model.stop and reached:
            return _TRIAL * model.stop / reached
    except EpicycleError:
        pass  # the first run fails; others may not
    return time.perf_counter() - started
