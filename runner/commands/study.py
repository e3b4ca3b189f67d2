"""run a study: a model under many conditions"""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import TYPE_CHECKING

from ..printing import complain, complain_traceback, tell
from .options import DONE, FAILED, INTERRUPTED, add_several, add_types, count, positive_seconds, seed

if TYPE_CHECKING:
    from ..study import Plan, StudyResults

DESCRIPTION = "Make all runs of a study that are not in its results folder yet."
SHOWN = 5  # failed runs that are told one by one


def add(command: argparse.ArgumentParser) -> None:
    """The options of ``epicycle study``."""
    command.add_argument("study", metavar="STUDY", help="a path to a YAML file, or the name of a packaged study")
    about = "set a parameter of the model that the study does not vary; may be repeated"
    add_several(command, "--set", "PATH=VALUE", about)
    command.add_argument(
        "--replications", type=count, metavar="N", help="runs of each condition (default: the study's); more are added"
    )
    command.add_argument(
        "--seed", type=first_seed, metavar="N", help="seed of the first replication (default: the study's)"
    )
    command.add_argument("--out", metavar="DIR", type=Path, help="results folder (default: results/STUDY)")
    command.add_argument("--yes", action="store_true", help="do not ask back whether so many runs are meant")
    add_types(command)
    add_session(command)


def add_session(command: argparse.ArgumentParser) -> None:
    """The options of a session, which ``resume`` has, too."""
    command.add_argument(
        "--executor",
        choices=("local", "dask"),
        default="local",
        help="where runs are made: in processes of this machine, or by workers of Dask (default: local)",
    )
    command.add_argument(
        "--scheduler",
        type=address,
        metavar="ADDRESS",
        help="the Dask scheduler whose workers make the runs (default: one of its own, with --jobs workers here)",
    )
    command.add_argument("--jobs", type=count, metavar="N", help="processes at a time (default: one for each core)")
    command.add_argument(
        "--run-timeout",
        type=positive_seconds,
        metavar="S",
        help="seconds of real time after which a run is ended, and counts as failed (default: none)",
    )
    command.add_argument(
        "--retry", action="store_true", help="make runs anew that took too long, or whose process was killed"
    )


def first_seed(text: str) -> int:
    """A seed after which those of all replications are seeds, too."""
    from ..language import MAX_STUDY_SEED

    return seed(text, MAX_STUDY_SEED)


def address(text: str) -> str:
    """Where a scheduler listens."""
    found = re.fullmatch(r"((?:tcp|tls|ws|wss)://)?([^\s:/]+|\[[0-9a-fA-F:]+\]):([0-9]{1,5})", text)
    if found is None or int(found[3]) >= 2**16:
        raise argparse.ArgumentTypeError(f"{text!r} is not an address such as tcp://localhost:8786")
    return f"{found[1] or 'tcp://'}{found[2]}:{found[3]}"


def run(options: argparse.Namespace, given: list[str]) -> int:
    """Read, try and run the study."""
    from ..language import read_study
    from ..show.report import check_figures
    from ..study import Plan, available_cores, check_size

    check_session(options)
    types = [Path(file) for file in options.types]
    study = read_study(
        options.study, set=options.set, types=types, replications=options.replications, seed=options.seed
    )
    if options.replications is not None and study.until is not None:
        complain(f"{study.name} decides itself how many replications it needs: --replications counts for nothing")
    plan = Plan.made(study)
    check_figures(plan)
    if not options.yes:
        check_size(plan, options.jobs or available_cores())
    return session(plan, options.out or Path("results") / study.name, options)


def about_others(results: StudyResults) -> list[str]:
    """What is to be said of runs that the study as it is now does not ask for."""
    from epicycle.actors import counted

    told = []
    if beyond := results.beyond():
        asked = counted(results.plan.replications, "replication")
        told.append(f"{results.folder} has {counted(beyond, 'run')} beyond the {asked} asked for: the table keeps them")
    if left_out := results.left_out:
        told.append(
            f"{results.folder} has {counted(left_out, 'run')} of another version of the study, its model or Epicycle, "
            "which the table leaves out"
        )
    return told


def check_session(options: argparse.Namespace) -> None:
    """Raise ``EpicycleError`` for options that do not go together."""
    from epicycle.actors import EpicycleError

    if options.scheduler is not None:
        if options.executor != "dask":
            raise EpicycleError(f"--scheduler {options.scheduler} is for --executor dask")
        if options.jobs is not None:
            raise EpicycleError(
                "--jobs counts processes of this machine; a scheduler has the workers that were started for it"
            )


def session(plan: Plan, folder: Path, options: argparse.Namespace) -> int:
    """Make the runs that are missing, and tell what came of it."""
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
        complain(f"interrupted; what was finished is kept: 'epicycle resume {folder}' goes on")
        return INTERRUPTED
    except (WorkerError, WriteError) as error:  # no fault of the study's
        complain(f"error: {error}")
        return FAILED
    tell(
        f"{plan.study.name}: {counted(plan.conditions, 'condition')}, {counted(outcome.made, 'new run')}, "
        f"{outcome.there:,} there before" + (f", {outcome.stopped_early:,} not needed" if outcome.stopped_early else "")
    )
    results = open_study(folder)
    for said in about_others(results):
        complain(said)
    tell(f"wrote {outcome.table}")
    if outcome.is_good:
        return DONE
    failures = results.failures()
    for row in failures[:SHOWN]:
        complain(f"{row['status']}: {row['error']}\n   repeat it: {row['replay']}")
    if len(failures) > SHOWN:
        complain(f"... and {len(failures) - SHOWN:,} more: epicycle status {folder}")
    if options.debug and failures:
        *_, raised = again(plan, plan.condition(failures[0]["condition"]), failures[0]["seed"])
        if raised is not None:
            complain(f"the first of them, repeated: run {failures[0]['run'][:12]}")
            complain_traceback(raised)
    complain(f"error: {counted(outcome.failed, 'run')} failed")
    return FAILED
