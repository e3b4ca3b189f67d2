"""The commands for studies: run one or continue it, show its progress, write its report."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...support.declare.commands import arguments
from ...support.printing import complain, complain_traceback, tell, tell_json
from ..calls import studying
from .options import DONE, FAILED, INTERRUPTED, command, option, taken

if TYPE_CHECKING:
    from ...study.judge.study_results import StudyResults
    from ...study.plan.plan import Plan

SHOWN = 5  # failed runs that are reported one by one
FOLDER = option("folder", metavar="DIR", type=Path, help="the results folder of the study")


# -- making runs ------------------------------------------------------------------------------------------------------


@command(
    "run a study: a model under many conditions; or continue one",
    taken(studying.study),
    option("--yes", action="store_true", help="make the runs even if there are very many"),
    imports=("show.report", "study"),
)
def study(options: argparse.Namespace) -> int:
    """Make all runs of a study that are not yet in its results folder; with a results folder, those that it lacks."""
    from epicycle.actors import EpicycleError

    from ...study.session import available_cores, check_size

    given = arguments(studying.study, options)
    names = ("executor", "scheduler", "jobs", "run_timeout", "retry", "part", "merge")
    session = {name: given.pop(name) for name in names if name in given}
    if "scheduler" in session:
        if session.get("executor") != "dask":
            raise EpicycleError(f"--scheduler {session['scheduler']} is for --executor dask")
        if "jobs" in session:
            raise EpicycleError(
                "--jobs counts processes on this machine and does not go with --scheduler, which has its own workers"
            )
    plan, folder = studying.plan_of(**given)
    if given.get("replications") is not None and plan.study.until is not None:
        complain(f"{plan.study.name} decides by 'until' how many replications it needs: --replications has no effect")
    if not options.yes and not Path(options.study).is_dir():
        check_size(plan, session.get("jobs", available_cores()))
    return _session(plan, folder, options, session)


def _session(plan: Plan, folder: Path, options: argparse.Namespace, session: dict[str, Any]) -> int:
    """Make the missing runs and report the outcome."""
    from epicycle.actors import counted

    from ...study.judge.study_results import open_study
    from ...study.run.progress import progress
    from ...study.run.runner import error_of
    from ...study.run.store import WriteError
    from ...study.session import run_study
    from ...support.apart import WorkerError

    try:
        with progress(plan.study.name) as told:
            outcome = run_study(plan, folder, tell=told, **session)
    except KeyboardInterrupt:
        complain(f"interrupted; finished runs are kept: 'epicycle study {folder}' continues")
        return INTERRUPTED
    except (WorkerError, WriteError) as error:  # not the study's fault
        complain(f"error: {error}")
        return FAILED
    tell(
        f"{plan.study.name}: {counted(plan.conditions, 'condition')}, {counted(outcome.made, 'new run')}, "
        f"{outcome.there:,} already there"
        + (f", {outcome.stopped_early:,} not needed" if outcome.stopped_early else "")
        + (f", in part {session['part']}" if "part" in session else "")
    )
    if outcome.table is None:
        tell(f"once all parts are over, 'epicycle study {folder}' makes what they have left and writes the table")
        if not outcome.failed:
            return DONE
        complain(f"error: {counted(outcome.failed, 'run')} failed: epicycle status {folder}")
        return FAILED
    results = open_study(folder)
    for said in _about_others(results):
        complain(said)
    tell(f"wrote {outcome.table}")
    if not outcome.failed:
        return DONE
    failures = results.failures()
    for row in failures[:SHOWN]:
        complain(_failure(row))
    if len(failures) > SHOWN:
        complain(f"... and {len(failures) - SHOWN:,} more: epicycle status {folder}")
    if options.debug and failures:
        raised = error_of(plan, plan.condition(failures[0]["condition"]), failures[0]["seed"])
        if raised is not None:
            complain(f"the first of them, repeated: run {failures[0]['run'][:12]}")
            complain_traceback(raised)
    complain(f"error: {counted(outcome.failed, 'run')} failed")
    return FAILED


def _failure(row: dict[str, Any]) -> str:
    return f"{row['status']}: {row['error']}\n   to repeat it: {row['replay']}"


def _about_others(results: StudyResults) -> Iterator[str]:
    """Notes on runs in the folder that the study in its present form does not ask for."""
    from epicycle.actors import counted

    if beyond := results.beyond():
        asked = counted(results.plan.replications, "replication")
        yield f"{results.folder} has {counted(beyond, 'run')} beyond the {asked} requested: they stay in the table"
    if left_out := results.left_out:
        yield (
            f"{results.folder} has {counted(left_out, 'run')} of another version of the study, its model or Epicycle: "
            "they are not in the table"
        )


# -- what the folder holds --------------------------------------------------------------------------------------------


@command(
    "show the progress of a study",
    FOLDER,
    option("--conditions", action="store_true", help="for each condition"),
    option("--json", action="store_true", help="print one JSON object"),
    imports=("study",),
)
def status(options: argparse.Namespace) -> int:
    """Show the progress of a study, also while it is running."""
    from ...study.judge.study_results import open_study
    from ...study.run.locking import is_running

    def counted(statuses: Counter[str]) -> str:
        return ", ".join(f"{number:,} {status}" for status, number in sorted(statuses.items()))

    results = open_study(options.folder).freeze()
    counts, running, failures, plan = results.counts(), is_running(options.folder), results.failures(), results.plan
    if options.json:
        found = {"study": plan.study.name, "runs": plan.size, "conditions": plan.conditions, "statuses": counts}
        tell_json({**found, "running": running, "failures": failures})
        return DONE
    beyond, most = results.beyond(), "at most " if plan.study.until or plan.search else ""
    tell(
        f"{plan.study.name}: {counts.total() - beyond:,} of {most}{plan.size:,} "
        f"runs are finished{f', and {beyond:,} more' if beyond else ''} ({counted(counts) or 'none yet'})"
        + ("; it is running" if running else "")
    )
    for told in _about_others(results):
        tell(told)
    if results.path.exists() and not running and not results.is_written():
        tell(
            f"{results.path} does not match the runs: it is damaged or out of date\n"
            f"   help: 'epicycle study {options.folder}' rewrites it"
        )
    if options.conditions:
        by_condition: dict[int, Counter[str]] = {}
        for row in results.table().select(["condition", "status"]).to_pylist():
            by_condition.setdefault(row["condition"], Counter())[row["status"]] += 1
        for index, statuses in by_condition.items():
            values = ", ".join(f"{name}={value}" for name, value in plan.condition(index).values.items())
            tell(f"{index} ({values}): {counted(statuses)} of {plan.replications:,}")
    for row in failures:
        tell(_failure(row))
    return DONE


@command(
    "write the report of a study",
    FOLDER,
    option("--out", metavar="DIR", type=Path, help="folder to write to (default: the results folder)"),
    taken(studying.study, only={"jobs", "types"}),
    imports=("show.report", "study"),
)
def report(options: argparse.Namespace) -> int:
    """Write report.html, a single self-contained file, and its figures; the study need not be finished."""
    from ...show.report import write_report
    from ...study.judge.study_results import open_study
    from ...study.session import available_cores
    from ...support.bars import bar, telling

    results = open_study(options.folder, types=getattr(options, "types", ()))
    folder, jobs = options.out or options.folder, getattr(options, "jobs", available_cores())

    def words(done: int, total: int) -> tuple[float, float, str]:
        return done, total, f"{done:,} of {total:,} runs repeated for their signals"

    with bar("report") as show:
        written = write_report(results, folder, jobs=jobs, tell=telling(show, words))
    for path in written.files:
        tell(f"wrote {path}")
    if written.verdicts:
        tell("claims: " + ", ".join(f"{number} {verdict}" for verdict, number in sorted(written.verdicts.items())))
    for problem in written.problems:
        complain(f"error: {problem}")
    return FAILED if written.problems else DONE
