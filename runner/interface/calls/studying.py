"""Many runs: a study of a model under many conditions, and variants of a model in pairs of runs."""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from ...support.declare.checked import checked
from ...support.declare.parameters import COUNT, argument, option, repeated
from .changes import JOBS, RUN_TIMEOUT, SEED, TYPES, UNTIL, first_seed

if TYPE_CHECKING:
    from ...model.build.model import Model
    from ...search.comparing import Comparison
    from ...study.judge.study_results import StudyResults
    from ...study.plan.plan import Plan
    from .changes import Changes

PROGRAM = Path("<python>")  # stands for the file of a study that a program gives as a mapping


def address(text: str) -> str:
    """The address of a scheduler."""
    found = re.fullmatch(r"((?:tcp|tls|ws|wss)://)?([^\s:/]+|\[[0-9a-fA-F:]+\]):([0-9]{1,5})", text)
    if found is None or int(found[3]) >= 2**16:
        raise argparse.ArgumentTypeError(f"{text!r} is not an address such as tcp://localhost:8786")
    return f"{found[1] or 'tcp://'}{found[2]}:{found[3]}"


@checked
def study(
    study: Annotated[
        str | Path | Mapping[str, object],
        argument("a path to a YAML file, the name of a packaged study, or a results folder to continue", "STUDY"),
    ],
    *,
    set: Annotated[
        Iterable[str] | Mapping[str, object],
        repeated("set a parameter of the model that the study does not vary", "PATH=VALUE"),
    ] = (),
    replications: Annotated[
        int | None,
        option("runs of each condition (default: the study's); a larger number adds runs", "N", COUNT),
    ] = None,
    seed: Annotated[int | None, option("seed of the first replication (default: the study's)", "N", first_seed)] = None,
    out: Annotated[str | Path | None, option("results folder (default: results/STUDY)", "DIR", Path)] = None,
    types: Annotated[Iterable[str | Path], TYPES] = (),
    executor: Annotated[
        Literal["local", "dask"],
        option(
            "where to make runs: in processes on this machine, or on Dask workers",
            choices=("local", "dask"),
        ),
    ] = "local",
    scheduler: Annotated[
        str | None,
        option(
            "the Dask scheduler whose workers make the runs (default: start one here, with --jobs workers)",
            "ADDRESS",
            address,
        ),
    ] = None,
    jobs: Annotated[int | None, JOBS] = None,
    run_timeout: Annotated[float | None, RUN_TIMEOUT] = None,
    retry: Annotated[bool, option("repeat runs that took too long, or whose process was killed")] = False,
    part: Annotated[
        str | None,
        option("make only a share of the runs, such as 3/16, while other machines make the others", "N/PARTS"),
    ] = None,
    merge: Annotated[
        Iterable[str | Path],
        repeated("take the runs of another results folder of the study, such as that of a part", "DIR"),
    ] = (),
    show_progress: bool = True,
) -> StudyResults:
    """Make the runs of a study that are not yet in its results folder (default: results/NAME), and return its results.

    ``study`` is a packaged study, a file, a results folder, or a mapping with the keys of such a file.  Runs are made
    in separate processes, ``jobs`` at a time (default: one per core).  Parts may share a folder; a call without
    ``part`` makes what they have left, and writes the table.

    >>> results = epicycle.study({"study": "load", "model": "mm1", "vary": {"load": [0.5, 0.7]}, "replications": 20})
    >>> results.means("mean_wait")
    """
    from contextlib import nullcontext

    from ...study.judge.study_results import open_study
    from ...study.run.progress import progress
    from ...study.session import run_study

    plan, folder = plan_of(study, set=set, replications=replications, seed=seed, out=out, types=types)
    with progress(plan.study.name) if show_progress else nullcontext() as tell:
        run_study(
            plan,
            folder,
            jobs=jobs,
            run_timeout=run_timeout,
            retry=retry,
            tell=tell,
            executor=executor,
            scheduler=scheduler,
            part=part,
            merge=merge,
        )
    return open_study(folder)


def plan_of(
    study: str | Path | Mapping[str, object],
    *,
    set: Iterable[str] | Mapping[str, object] = (),
    replications: int | None = None,
    seed: int | None = None,
    out: str | Path | None = None,
    types: Iterable[str | Path] = (),
) -> tuple[Plan, Path]:
    """The plan of a study, and its folder; raises ``ModelError``, and ``StoreError`` for a folder with a search."""
    import shlex

    import yaml

    from epicycle.actors import EpicycleError

    from ...model.catalogue.packaged import packaged_studies
    from ...model.language.study import read_study, study_of_text
    from ...model.text.document import plain
    from ...model.text.program import call_site, node_of
    from ...search.spec import results_folder
    from ...show.report import check_figures
    from ...study.plan.plan import Plan
    from ...study.run.manifest import StoreError
    from ...study.run_spec import as_settings
    from ...study.session import plan_of_folder

    files, settings = [Path(each) for each in types], as_settings(set)
    if isinstance(study, Mapping):
        said = {key: str(value) if isinstance(value, Path) else value for key, value in study.items()}
        try:
            text = yaml.safe_dump(plain(node_of(said, call_site())), sort_keys=False, allow_unicode=True)
        except yaml.representer.RepresenterError as error:
            raise EpicycleError(
                f"a study is made of numbers, texts, lists and mappings, not of {error.args[1]!r}"
            ) from None
        found = study_of_text(text, PROGRAM, settings, files, replications, seed)
    elif (folder := Path(study)).is_dir() and str(study) not in packaged_studies():
        given = {"--set": settings, "--replications": replications, "--seed": seed, "--out": out}
        if told := [flag for flag, value in given.items() if value not in (None, [])]:
            raise EpicycleError(f"the study in {folder} is continued as it is: without {', '.join(told)}")
        plan = plan_of_folder(folder, files)
        if plan.search is not None:
            command = shlex.join(plan.search["command"])
            raise StoreError(f"{folder} holds a search, which its own command continues\n   help: {command}")
        return plan, folder
    else:
        found = read_study(study, set=settings, types=files, replications=replications, seed=seed)
    plan = Plan.made(found)
    check_figures(plan)
    return plan, results_folder(plan.study.name) if out is None else Path(out)


@checked
def compare(
    model: Annotated[Model | str | Path, argument("a path to a YAML file, or the name of a packaged model", "MODEL")],
    variants: Mapping[str, Model | Changes] | Sequence[str],
    *,
    replications: Annotated[int, option("runs of each variant", "N", COUNT)] = 10,
    seed: Annotated[int | None, SEED] = None,
    until: Annotated[float | str | None, UNTIL] = None,
    out: Annotated[
        str | Path | None, option("folder for what is found (default: results/MODEL/comparison)", "DIR", Path)
    ] = None,
    jobs: Annotated[int | None, JOBS] = None,
    progress: bool = True,
) -> Comparison:
    """Run variants of a model with the same seeds, and compare their metrics in pairs of runs.

    A variant is a set of changes as ``load`` takes them, or another model; a list names disturbances, where ``none`` is
    the unchanged model.  Seeds count up from ``seed`` (default: the model's).  Runs that fail are reported and left
    out.  Each other run is noted in a folder, so that a comparison that was interrupted, or gets more runs or variants,
    continues.

    >>> epicycle.compare("collision_avoidance", ["none", "wifi_burst"], replications=20)
    >>> epicycle.compare("mm1", {"slow": {}, "fast": {"set": {"mean_service": 0.8}}})
    """
    from ...search.comparing import compare as compare_models
    from ...study.run_spec import seconds
    from ...support.bars import SOON, bar, telling
    from .running import opened
    from .searching import folder_for

    if not isinstance(variants, Mapping):
        variants = {name: {} if name == "none" else {"disturb": name} for name in variants}
    models = {
        name: each if not isinstance(each, Mapping) else opened(model, None, None, each).model
        for name, each in variants.items()
    }
    folder = folder_for([*models.values()], out, "comparison")
    with bar("compare", after=SOON) as show:
        answer = compare_models(
            models,
            replications=replications,
            seed=seed,
            until=seconds("until", until),
            folder=folder,
            jobs=jobs,
            tell=telling(show, lambda *told: told, progress),
        )
    answer.folder = folder
    return answer
