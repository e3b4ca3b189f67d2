"""The commands for studies: run one, resume it, show its progress, repeat one of its runs, write its report."""

from __future__ import annotations

import argparse
import re
import shlex
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..printing import complain, complain_traceback, console, tell, tell_json
from .options import (
    COUNT,
    DONE,
    FAILED,
    INTERRUPTED,
    JOBS,
    RUN_TIMEOUT,
    TYPES,
    command,
    complain_of,
    first_seed,
    option,
    several,
)

if TYPE_CHECKING:
    from ..study import Plan, StudyResults

SHOWN = 5  # failed runs that are reported one by one


def address(text: str) -> str:
    """The address of a scheduler."""
    found = re.fullmatch(r"((?:tcp|tls|ws|wss)://)?([^\s:/]+|\[[0-9a-fA-F:]+\]):([0-9]{1,5})", text)
    if found is None or int(found[3]) >= 2**16:
        raise argparse.ArgumentTypeError(f"{text!r} is not an address such as tcp://localhost:8786")
    return f"{found[1] or 'tcp://'}{found[2]}:{found[3]}"


# -- making runs ------------------------------------------------------------------------------------------------------

FOLDER = option("folder", metavar="DIR", type=Path, help="the results folder")
FOLDER_OF_STUDY = option("folder", metavar="DIR", type=Path, help="the results folder of the study")
SESSION = (
    option(
        "--executor",
        choices=("local", "dask"),
        default="local",
        help="where to make runs: in processes on this machine, or on Dask workers (default: local)",
    ),
    option(
        "--scheduler",
        type=address,
        metavar="ADDRESS",
        help="the Dask scheduler whose workers make the runs (default: start one here, with --jobs workers)",
    ),
    JOBS,
    RUN_TIMEOUT,
    option("--retry", action="store_true", help="repeat runs that took too long, or whose process was killed"),
)


@command(
    "run a study: a model under many conditions",
    option("study", metavar="STUDY", help="a path to a YAML file, or the name of a packaged study"),
    several(
        "--set",
        metavar="PATH=VALUE",
        help="set a parameter of the model that the study does not vary; may be repeated",
    ),
    option(
        "--replications",
        type=COUNT,
        metavar="N",
        help="runs of each condition (default: the study's); a larger number adds runs",
    ),
    option("--seed", type=first_seed, metavar="N", help="seed of the first replication (default: the study's)"),
    option("--out", metavar="DIR", type=Path, help="results folder (default: results/STUDY)"),
    option("--yes", action="store_true", help="make the runs even if there are very many"),
    TYPES,
    *SESSION,
    imports=("show.report", "study"),
)
def study(options: argparse.Namespace) -> int:
    """Make all runs of a study that are not yet in its results folder."""
    from ..language.study import read_study
    from ..show.report import check_figures
    from ..study import Plan, available_cores, check_size

    _check_session(options)
    found = read_study(
        options.study,
        set=options.set,
        types=map(Path, options.types),
        replications=options.replications,
        seed=options.seed,
    )
    if options.replications is not None and found.until is not None:
        complain(f"{found.name} decides by 'until' how many replications it needs: --replications has no effect")
    plan = Plan.made(found)
    check_figures(plan)
    if not options.yes:
        check_size(plan, options.jobs or available_cores())
    return _session(plan, options.out or Path("results") / found.name, options)


@command("resume a study", FOLDER, TYPES, *SESSION, imports=("study",))
def resume(options: argparse.Namespace) -> int:
    """Make the runs that are missing from the results folder of a study."""
    from ..study import StoreError, plan_of_folder

    _check_session(options)
    plan = plan_of_folder(options.folder, map(Path, options.types))
    if plan.search is not None:
        told = shlex.join(plan.search["command"])
        raise StoreError(f"{options.folder} holds a search, which its own command continues\n   help: {told}")
    return _session(plan, options.folder, options)


def _check_session(options: argparse.Namespace) -> None:
    """Raise ``EpicycleError`` for options that exclude each other."""
    from epicycle.actors import EpicycleError

    if options.scheduler is not None:
        if options.executor != "dask":
            raise EpicycleError(f"--scheduler {options.scheduler} is for --executor dask")
        if options.jobs is not None:
            raise EpicycleError(
                "--jobs counts processes on this machine and does not go with --scheduler, which has its own workers"
            )


def _session(plan: Plan, folder: Path, options: argparse.Namespace) -> int:
    """Make the missing runs and report the outcome."""
    from epicycle.actors import counted

    from ..study import WorkerError, WriteError, again, open_study, progress, run_study

    try:
        with progress(plan.study.name) as told:
            outcome = run_study(
                plan,
                folder,
                jobs=options.jobs,
                timeout=options.run_timeout,
                retry=options.retry,
                tell=told,
                executor=options.executor,
                scheduler=options.scheduler,
            )
    except KeyboardInterrupt:
        complain(f"interrupted; finished runs are kept: 'epicycle resume {folder}' continues")
        return INTERRUPTED
    except (WorkerError, WriteError) as error:  # not the study's fault
        complain(f"error: {error}")
        return FAILED
    tell(
        f"{plan.study.name}: {counted(plan.conditions, 'condition')}, {counted(outcome.made, 'new run')}, "
        f"{outcome.there:,} already there"
        + (f", {outcome.stopped_early:,} not needed" if outcome.stopped_early else "")
    )
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
        *_, raised = again(plan, plan.condition(failures[0]["condition"]), failures[0]["seed"])
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
    from ..study import is_running, open_study

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
            f"   help: 'epicycle resume {options.folder}' rewrites it"
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
    "repeat one run of a study",
    FOLDER_OF_STUDY,
    option("run_key", metavar="RUN", help="the run's name in the column 'run', or the beginning of the name"),
    option("--out", metavar="DIR", type=Path, help="folder to write to (default: DIR/replays/RUN)"),
    TYPES,
    imports=("build", "show", "study"),
)
def replay(options: argparse.Namespace) -> int:
    """Repeat one run of a study, with its event log, all recorded signals and figures."""
    from ..build.figures import figures_of
    from ..calls import RunSpec
    from ..results import write_log
    from ..show import check_folder, draw_figures, summary_table, write_folder
    from ..study import again, open_study, plan_of_folder
    from ..text.problems import Problems

    row = open_study(options.folder).find(options.run_key)
    plan = plan_of_folder(options.folder, map(Path, options.types))
    folder = options.out or options.folder / "replays" / row["run"][:12]
    model, results, error = again(plan, plan.condition(row["condition"]), row["seed"])
    errors = [] if error is None else [error]
    figures = {} if errors else figures_of(model, Problems())
    if replaced := check_folder(folder, model.name, options.given):
        complain(replaced)
    how = RunSpec(study=str(options.folder), run=row["run"][:12]).plain()
    written = write_folder(folder, results, options.given, "".join(map(str, errors)), how)
    written.append(folder / "log.parquet")
    write_log(results.log.records, written[-1])
    drawn, failed = draw_figures(folder, results, figures)
    console().print(summary_table(model, results))
    for path in [*drawn, *written]:
        tell(f"wrote {path}")
    if errors or failed:
        return complain_of([*errors, *failed], options)
    if row["digest"] is not None and row["digest"] != results.digest:
        complain(f"error: the digest is {results.digest}, but was {row['digest']}: something has changed since")
        return FAILED
    tell(f"digest {results.digest}" + (": the same" if row["digest"] is not None else ""))
    return DONE


@command(
    "write the report of a study",
    FOLDER_OF_STUDY,
    option("--out", metavar="DIR", type=Path, help="folder to write to (default: the results folder)"),
    option("--jobs", metavar="N", type=COUNT, help="runs to repeat at the same time (default: one per core)"),
    TYPES,
    imports=("show.report", "study"),
)
def report(options: argparse.Namespace) -> int:
    """Write report.html, a single self-contained file, and its figures; the study need not be finished."""
    from rich.progress import Progress

    from ..show.report import write_report
    from ..study import available_cores, open_study

    results, terminal = open_study(options.folder, types=options.types), console(stderr=True)
    folder, jobs = options.out or options.folder, options.jobs or available_cores()
    with Progress(console=terminal, transient=True, disable=not terminal.is_terminal) as bar:
        task = bar.add_task("repeating runs for their signals", total=None)

        def tell_of(done: int, total: int) -> None:
            bar.update(task, completed=done, total=total)

        written = write_report(results, folder, jobs=jobs, tell=tell_of)
    for path in written.files:
        tell(f"wrote {path}")
    if written.verdicts:
        tell("claims: " + ", ".join(f"{number} {verdict}" for verdict, number in sorted(written.verdicts.items())))
    for problem in written.problems:
        complain(f"error: {problem}")
    return FAILED if written.problems else DONE
