"""A study from Python: a packaged one, a file, or a mapping with the contents of such a file."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import Literal

import yaml

from ..language.study import Study as StudyText
from ..language.study import read_study, study_of_text
from ..show.report import check_figures
from ..study import Plan, StudyResults, open_study, progress, run_study
from ..text.document import plain
from ..text.program import call_site, node_of

PROGRAM = Path("<python>")  # stands for the file of a study that a program gives as a mapping


def study(
    study: str | Path | Mapping[str, object],
    *,
    set: Iterable[str] | Mapping[str, object] = (),
    replications: int | None = None,
    seed: int | None = None,
    out: str | Path | None = None,
    types: Iterable[str | Path] = (),
    jobs: int | None = None,
    run_timeout: float | None = None,
    retry: bool = False,
    executor: Literal["local", "dask"] = "local",
    scheduler: str | None = None,
    show_progress: bool = True,
) -> StudyResults:
    """Make the runs of a study that are not yet in its results folder (default: results/NAME), and return its results.

    ``study`` is a packaged study, a file, or a mapping with the keys of such a file.  The other parameters are the
    options of ``epicycle study``.  Runs are made in separate processes, ``jobs`` at a time (default: one per core).

    >>> results = epicycle.study({"study": "load", "model": "mm1", "vary": {"load": [0.5, 0.7]}, "replications": 20})
    >>> results.means("mean_wait")
    """
    plan = Plan.made(_read(study, as_settings(set), map(Path, types), replications, seed))
    check_figures(plan)
    folder = Path("results") / plan.study.name if out is None else Path(out)
    with progress(plan.study.name) if show_progress else nullcontext() as tell:
        run_study(
            plan,
            folder,
            jobs=jobs,
            timeout=run_timeout,
            retry=retry,
            tell=tell,
            executor=executor,
            scheduler=scheduler,
        )
    return open_study(folder)


def as_settings(said: Iterable[str] | Mapping[str, object]) -> list[str]:
    """What the command line says of values by path: ``path=value``."""
    if not isinstance(said, Mapping):
        return list(said)
    return [f"{path}={json.dumps(plain(node_of(value, call_site())))}" for path, value in said.items()]


def _read(
    study: str | Path | Mapping[str, object],
    set: Iterable[str],
    types: Iterable[Path],
    replications: int | None,
    seed: int | None,
) -> StudyText:
    if not isinstance(study, Mapping):
        return read_study(study, set=set, types=types, replications=replications, seed=seed)
    said = {key: str(value) if isinstance(value, Path) else value for key, value in study.items()}
    text = yaml.safe_dump(plain(node_of(said, call_site())), sort_keys=False, allow_unicode=True)
    return study_of_text(text, PROGRAM, set, types, replications, seed)
