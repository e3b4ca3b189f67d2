"""One run: load a model, run it, look at it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Unpack

from ...support.declare.checked import checked
from ...support.declare.parameters import COUNT, argument, number, option
from .changes import SEED, UNTIL, Changes, classes

if TYPE_CHECKING:
    from ...execution.results import Results
    from ...model.build.model import Model
    from ...show.view.pages import Page
    from ...study.run_spec import OpenedRun

REFERENCE = "a model, the results folder of a run, or a run of a study, such as results/table_1/3f9a0c"


def factor(text: str) -> float:
    """How many seconds of model time pass per second."""
    import argparse
    import math

    from ...execution.engine import SLOWEST

    if not SLOWEST <= (found := number(text)) < math.inf:
        # Perhaps the model, which follows the option.
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a number of at least {SLOWEST:g} (write MODEL before --realtime)"
        )
    return found


@checked
def load(
    model: Annotated[str | Path, argument("a path to a YAML file, or the name of a packaged model", "MODEL")],
    *,
    partial: bool = False,
    **changes: Unpack[Changes],
) -> Model:
    """Load a packaged model or a file, with changes.

    ``set`` gives parameters their values, ``overrides`` files with such values, ``disturb`` disturbances, ``aspects``
    further aspects, ``without_aspects`` those that go; ``types`` are classes of your own, or files with them.  Of a
    ``partial`` model, inputs may be unconnected, to which the program will connect something before it runs.  Raises
    ``ModelError`` with everything that is wrong.

    >>> epicycle.load("mm1", set={"load": 0.9}).parameters["load"]
    """
    from ...model.build.load import load_model
    from ...study.run_spec import RunSpec, named

    given = list(changes.get("types", ()))
    more: Any = {**changes, "types": classes(given), "partial": partial}
    made = load_model(model, **more)
    if any(isinstance(each, type) for each in given):  # which nothing but this program knows
        return made
    return named(made, RunSpec.of(model, None, None, changes))


def opened(
    model: Model | str | Path, seed: int | None, until: float | str | None, changes: Mapping[str, Any]
) -> OpenedRun:
    """The run of a model that exists, or of what names one; an existing model takes no changes."""
    from epicycle.actors import EpicycleError

    from ...model.build.model import Model
    from ...study.run_spec import OpenedRun, RunSpec, is_reference, named, seconds
    from ...study.run_spec import opened as opened_run

    if isinstance(model, Model):
        if changes:
            raise EpicycleError(
                f"the model {model.name} exists already and takes no {', '.join(changes)}\n"
                "   help: give the name or file of the model instead, or pass them to load"
            )
        return OpenedRun(model, seed, seconds("until", until))
    if is_reference(model):
        return opened_run(RunSpec.of(model, seed, until, changes), "until")
    made = load(model, **changes)
    if made.origin is not None and made.origin.spec is not None:
        named(made, replace(made.origin.spec, until=until))
    return OpenedRun(made, seed, seconds("until", until))


@checked
def run(
    model: Annotated[Model | str | Path, argument(REFERENCE, "MODEL or RESULTS")],
    *,
    seed: Annotated[int | None, SEED] = None,
    until: Annotated[float | str | None, UNTIL] = None,
    realtime: Annotated[
        float | None,
        option(
            "limit model time to FACTOR seconds per second of the wall clock (default: 1)", "FACTOR", factor, bare=1.0
        ),
    ] = None,
    keep_log: bool = False,
    log: Annotated[
        str | Path | None, option("write the event log to FILE (.parquet, .csv or .jsonl)", "FILE", Path)
    ] = None,
    out: Annotated[
        str | Path | None,
        option("folder for manifest, signals and figures (default: results/MODEL; with --json: none)", "DIR", Path),
    ] = None,
    max_tags: Annotated[int | None, option("end the run after N tags (default: no limit)", "N", COUNT)] = None,
    progress: bool = True,
    **changes: Unpack[Changes],
) -> Results:
    """Run a model once: a packaged one, a file, or a loaded or built model.

    ``set``, ``disturb`` and the other options of ``load`` change it first.  ``until`` is the stop time (s, or a text
    with a unit), ``realtime`` the seconds of model time that pass per second.  ``keep_log`` keeps the event log in
    ``results.log``, ``log`` writes it to a file (.parquet, .csv, .jsonl), ``out`` writes manifest, signals and figures
    into a folder.  After ``max_tags`` tags the run ends.
    A long run shows a bar in a notebook or on a terminal, unless ``progress`` is false.

    >>> epicycle.run("mm1", seed=3, set={"load": 0.9}).metrics["mean_wait"]
    """
    from ...execution.engine import Pace
    from ...execution.results import LogFile
    from ...show.performing import perform

    found = opened(model, seed, until, changes)
    done = perform(
        found.model,
        seed=found.seed,
        until=found.until,
        pace=None if realtime is None else Pace(realtime),
        keep_log=keep_log or log is not None,
        log=None if log is None else LogFile(Path(log)),
        folder=None if out is None else Path(out),
        progress=progress,
        most=max_tags,
    )
    for error in done.failed:
        raise error
    return done.results


@checked
def view(
    *models: Annotated[Model | str | Path, argument(f"one or two of: {REFERENCE}", "MODEL or RESULTS", "+")],
    seed: Annotated[int | None, SEED] = None,
    until: Annotated[float | str | None, UNTIL] = None,
    names: Sequence[str] = (),
    progress: bool = True,
    **changes: Unpack[Changes],
) -> Page:
    """Run a model, or two for comparison, and show what happened: space, graph, signals, and what caused what.

    ``set``, ``disturb`` and the other options of ``load`` change each model given by name or file; ``names`` tell two
    runs apart.  ``save`` writes the page, ``open`` shows it in the browser, a notebook shows it in place.

    >>> epicycle.view("collision_avoidance", disturb="wifi_burst").save("run.html")
    """
    from epicycle.actors import EpicycleError

    from ...model.build.model import Model
    from ...show.view.pages import recorded

    if not 1 <= len(models) <= 2:
        raise EpicycleError(f"a page shows one run or two, not {len(models)}")
    if names and len(names) != len(models):
        raise EpicycleError(f"names: {len(names)} given for {len(models)} models")
    runs = [opened(each, seed, until, {} if isinstance(each, Model) else changes) for each in models]
    if len(runs) == 2 and not names:
        names = [each.model.name for each in runs]
        names = [f"{name} {number}" for number, name in enumerate(names, 1)] if len({*names}) == 1 else names
    return recorded(runs, names=names, progress=progress)
