"""A session of a study: missing runs are made, and the state is reported."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from epicycle.actors import EpicycleError, counted

from ..execution.engine import Simulation
from .judge.study_results import StudyResults
from .plan.plan import Plan, epicycle_version
from .provenance import git_revision, machine, versions
from .run.backlog import RETRIED, Backlog
from .run.locking import lock
from .run.making import Recorder, make_here, recording
from .run.manifest import FORMAT, StoreError, read_manifest
from .run.progress import duration
from .run.share import ALL, Share
from .run.store import prepare, take

LOCAL, DASK = "local", "dask"  # executors
MANY = 100_000  # runs; larger studies need confirmation
_TRIAL = 5.0  # s, at most, for measuring how long a run takes


class TooManyRunsError(EpicycleError):
    """A study larger than its author may think."""


@dataclass
class Outcome:
    """The outcome of a session: runs by status, those that it made and those that existed."""

    made: int
    there: int
    failed: int  # new and existing
    stopped_early: int
    table: Path | None  # none for a share of the runs: the folder may lack those of others


def run_study(
    plan: Plan,
    folder: Path,
    *,
    jobs: int | None = None,
    run_timeout: float | None = None,
    retry: bool = False,
    tell: Callable[[Backlog], None] | None = None,
    executor: str = LOCAL,
    scheduler: str | None = None,
    part: str | None = None,
    merge: Iterable[str | Path] = (),
) -> Outcome:
    """Make all runs of a plan that are not yet in the folder, in ``jobs`` processes at a time (default: one per core).

    A run that raises gets a row with the status ``failed``, one that takes longer than ``run_timeout`` seconds a row
    ``timeout``.  One whose process dies is repeated, and after three attempts gets a row ``killed``; ``retry`` repeats
    both kinds.  ``tell`` is called now and then.  ``executor``: ``local``, or ``dask`` for the workers of the Dask
    ``scheduler`` at that address or, without one, a cluster on this machine.  With a ``part`` of the runs, such as
    3/16, others may write to the folder at the same time, if it is a whole session that ends the study.  The rows of
    the folders to ``merge``, which hold results of the same study, are taken first.  Raises ``StoreError`` and
    ``WorkerError``, and ``EpicycleError`` if Dask is requested but not installed.
    """
    make, share = _maker(executor, scheduler), Share.named(part)  # before anything is written
    with lock(folder, share):
        store = prepare(folder, manifest_of(plan), share)
        for other in merge:
            take(store, Path(other))
        known = store.known(plan.decides, journals=share == ALL)
        known = {key: done for key, done in known.items() if not (retry and done.status in RETRIED)}
        backlog = Backlog(plan, known, share=share)
        with recording(store, backlog, run_timeout) as recorder:
            make(recorder, jobs or available_cores(), lambda: None if tell is None else tell(backlog))
        table = StudyResults(folder).write_table() if share == ALL else None
    made, there = backlog.made.total(), backlog.there.total()
    return Outcome(made, there, backlog.failed, backlog.stopped_early, table)


def _maker(executor: str, scheduler: str | None) -> Callable[[Recorder, int, Callable[[], None]], None]:
    """A function that makes all runs of a backlog, ``jobs`` at a time, and now and then calls its last argument.

    Raises ``EpicycleError`` if what an executor needs is not installed.
    """
    if executor != DASK:
        if scheduler is not None:
            raise EpicycleError(f"the scheduler {scheduler} is for the executor {DASK!r}")
        return make_here
    # Imported here, not with this package, which several threads of a Dask worker may import at once: the first to
    # import `parcel` must not find the package waiting for it.
    from .run.cluster import Cluster, distributed_module

    distributed_module()
    return lambda recorder, jobs, tell: Cluster(recorder, jobs, scheduler).run(tell)


def manifest_of(plan: Plan) -> dict[str, Any]:
    """The contents of the manifest: the plan, and what its results are made with."""
    study = plan.study
    return {
        "format": FORMAT,
        **plan.manifest(),
        "versions": versions(),
        "machine": machine(),
        "git": git_revision(study.path.resolve().parent),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def plan_of_folder(folder: Path, types: Iterable[Path] = ()) -> Plan:
    """The plan of a results folder, whose runs are to be made or repeated.

    Code runs only if this user has made the folder on this machine, or if the files are named again in ``types``.
    Raises ``StoreError`` if its model or Epicycle has changed, and ``CodeError``.
    """
    manifest = read_manifest(folder)
    before = Plan.of_manifest(manifest)
    if (version := epicycle_version()) != before.made_with:
        raise StoreError(
            f"{folder} was made with Epicycle {before.made_with}, but this is Epicycle {version}\n"
            f"   help: install that version, or repeat all runs: 'epicycle study {before.study.path} --out ANOTHER'"
        )
    if named := tuple(types):
        before = before.allowed(named)
    before.check_allowed()
    plan = replace(Plan.made(before.study), search=before.search)
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
    """Raise ``TooManyRunsError`` for a study of very many runs, with an estimate of its duration."""
    if plan.size <= MANY:
        return
    seconds = seconds_of_a_run(plan) * plan.size / jobs
    raise TooManyRunsError(
        f"{plan.study.name} has {plan.conditions:,} conditions of {counted(plan.replications, 'replication')}: "
        f"{plan.size:,} runs, which take about {duration(seconds)} with {jobs} at a time\n"
        "   help: add --yes if that is what you want"
    )


def seconds_of_a_run(plan: Plan) -> float:
    """The duration of the first run, or its estimate after a few seconds."""
    condition = plan.condition(0)
    model = plan.load(condition)
    started = time.perf_counter()
    try:
        simulation = Simulation(model, seed=plan.seed(condition, 0))
        while simulation.step():
            if (taken := time.perf_counter() - started) > _TRIAL:
                reached = simulation.tag.seconds
                return taken * model.stop / reached if model.stop and reached else taken
    except EpicycleError:
        pass  # the first run fails; others may succeed
    return time.perf_counter() - started
