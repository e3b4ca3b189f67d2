"""Searches over runs: one that breaks a property, why it does, how rare that is, and parameters that are best."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypedDict, Unpack, overload

from ...search.spec import GOALS, Break, Goal, Match, Minimise, results_folder
from ...support.declare.checked import as_declared, checked
from ...support.declare.parameters import COUNT, argument, option, repeated
from .changes import (
    ASPECTS,
    DISTURB,
    JOBS,
    NAME_OR_PROPERTY,
    RUN_TIMEOUT,
    SEED,
    SET,
    TYPES,
    UNTIL,
    WITHOUT,
    Changes,
    first_seed,
)
from .running import REFERENCE, opened

if TYPE_CHECKING:
    from ...model.build.model import Model
    from ...search.calibration import Calibration
    from ...search.explanation import Explanation
    from ...search.falsifying import Falsification
    from ...search.optimising import Optimum
    from ...search.splitting import RareEvent


def _out(kind: str) -> Any:
    return option(f"folder for what is found (default: results/MODEL/{kind})", "DIR", Path)


def folder_for(models: Sequence[Model], out: str | Path | None, kind: str) -> Path | None:
    """Where runs of models are noted: by default only if they can be told from those of others."""
    if out is not None:
        return Path(out)
    if not models or any(model.origin is None for model in models):
        return None
    return results_folder(models[0].name, kind)


class SearchOptions(TypedDict, total=False):
    """What a search is given besides its goal."""

    vary: Annotated[
        Iterable[str] | Mapping[str, object],
        repeated("search a parameter: load=0.5..0.9, period='1 s..5 s', 'policy=[fifo, lifo]'", "PATH=VALUES"),
    ]
    seed: Annotated[
        int | None,
        option(
            "seed of the search and of its first run (default: 0 with --break, else the model's or study's)",
            "N",
            first_seed,
        ),
    ]
    set: Annotated[Iterable[str] | Mapping[str, object], SET]
    disturb: Annotated[str | Path | Iterable[str | Path], DISTURB]
    aspects: Annotated[Iterable[str], ASPECTS]
    without_aspects: Annotated[Iterable[str], WITHOUT]
    until: Annotated[float | str | None, UNTIL]
    types: Annotated[Iterable[str | Path], TYPES]
    out: Annotated[str | Path | None, _out("falsification, optimisation or calibration")]
    jobs: Annotated[int | None, JOBS]
    run_timeout: Annotated[float | None, RUN_TIMEOUT]
    progress: bool
    command: Sequence[str]


MODEL_OR_STUDY = argument("a path to a YAML file, or the name of a packaged model or study", "MODEL or STUDY")


@overload
def search(model: str | Path, goal: Break, **given: Unpack[SearchOptions]) -> Falsification: ...
@overload
def search(model: str | Path, goal: Minimise, **given: Unpack[SearchOptions]) -> Optimum: ...
@overload
def search(model: str | Path, goal: Match, **given: Unpack[SearchOptions]) -> Calibration: ...
@checked
def search(
    model: Annotated[str | Path, MODEL_OR_STUDY], goal: Goal, **given: Unpack[SearchOptions]
) -> Falsification | Optimum | Calibration:
    """Search for a run that breaks a property, or for the best parameters: by a metric, or by measured signals.

    Points are spread over the ranges of --vary first.  Then CMA-ES goes towards less robustness or a better mean, if
    its library is installed; for --match, least squares start from the best three.  Each run is kept in a folder, where
    a search that was interrupted continues.

    --break: each run has the next seed.  The search ends at the first broken run, with exit code 3, and with 0 when all
    runs are made and none is broken, which does not show that the property holds.

    --minimise, --maximise: the best point is run once more with new seeds, because its own runs chose it.  The exit
    code is 1 if no point meets the conditions.

    --match: the folder gets the parameters as a file for --overrides, the facts as JSON, and the residuals.

    >>> epicycle.search("mm1", epicycle.Break("always server.size < 40"), vary={"load": "0.5..0.9"}).sentence
    >>> epicycle.search("mm1", epicycle.Minimise("mean_wait"), vary={"mean_service": "0.5 s..0.9 s"}).best
    >>> goal = epicycle.Match({"plant.output": "step.csv"})
    >>> epicycle.search("pid_loop", goal, vary={"plant.time_constant": "0.5 s..5 s"}).best
    """
    from epicycle.actors import EpicycleError

    from ...search.calibrating import calibrate
    from ...search.falsifying import falsify
    from ...search.optimising import optimise
    from ...search.space import SearchSpec
    from ...study.run_spec import as_settings, seconds
    from ...support.bars import bar, unseen

    if unknown := given.keys() - SearchOptions.__annotations__.keys():
        raise TypeError(f"search() got an unexpected keyword argument {min(unknown)!r}")
    if not isinstance(goal, GOALS):
        raise EpicycleError(f"goal: {goal!r} is none of {', '.join(each.__name__ for each in GOALS)}")
    goal = replace(goal, **as_declared(type(goal), vars(goal)))
    types: Iterable[Any] = given.get("types", ())
    if classes := [each.__name__ for each in types if isinstance(each, type)]:
        raise EpicycleError(
            f"types: the processes of a search do not know the class {classes[0]} of this program\n"
            "   help: write it to a file, and name that: types=['my_types.py']"
        )
    vary, command, out = given.get("vary", ()), tuple(given.get("command", ())), given.get("out")
    until = seconds("--until" if command else "until", given.get("until"))
    spec = SearchSpec.of(model, given.get("seed"), until, given)
    spec = replace(spec, vary=tuple(as_settings(vary, are_ranges=True)), continued_by=command)
    folder = None if out is None else Path(out)
    jobs, timeout = given.get("jobs"), given.get("run_timeout")
    with bar("search") as shown:
        show = shown if shown is not None and given.get("progress", True) else unseen
        if isinstance(goal, Break):
            return falsify(spec, goal, folder, jobs=jobs, timeout=timeout, show=show)
        if isinstance(goal, Minimise):
            return optimise(spec, goal, folder, jobs=jobs, timeout=timeout, show=show)
        if timeout is not None:
            raise EpicycleError("--run-timeout is not for --match, which needs every run")
        return calibrate(spec, goal, folder, jobs=jobs, show=show)


@checked
def explain(
    model: Annotated[Model | str | Path, argument(REFERENCE, "MODEL or RESULTS")],
    monitor: Annotated[
        str | None,
        option(
            "a monitor of the model, or a property such as 'always clearance.distance >= 2 m' (default: the one of the "
            "model's that is broken first)",
            NAME_OR_PROPERTY,
        ),
    ] = None,
    *,
    seed: Annotated[int | None, SEED] = None,
    until: Annotated[float | str | None, UNTIL] = None,
    runs: Annotated[int, option("number of sets of faults that are tried at most", "N", COUNT)] = 500,
    only: Annotated[
        str | Iterable[str], repeated("look at the faults of this aspect; those of others happen", "ASPECT")
    ] = (),
    out: Annotated[str | Path | None, _out("explanation")] = None,
    jobs: Annotated[int | None, JOBS] = None,
    progress: bool | Callable[[int, int], None] = True,
    flag: str = "",
    **changes: Unpack[Changes],
) -> Explanation:
    """Find the smallest set of faults that breaks a property of a run.

    Faults are single doings of aspects: losses, delays, failures.  With these and no others the property is broken;
    without any single one of them it holds.  A search that comes to its limit of runs, or is interrupted, tells the
    smallest set so far.  The folder gets a disturbance with just these faults, the facts as JSON, and a page that shows
    both runs.  Each run that was tried is noted there, so that the same call, or one with more runs, continues.  In a
    program, ``progress`` may be a function of the numbers of sets tried, and of faults in the smallest one.

    >>> epicycle.explain("collision_avoidance", "always clearance.distance >= 4 m", seed=3, set={"disturbance": 0.5})
    """
    from ...search.explaining import explain as search
    from ...search.monitored import monitors_named
    from ...study.run_spec import spec_of
    from ...support.bars import bar, telling

    found = opened(model, seed, until, changes)
    made, seed = copy.copy(found.model), found.model.output.seed if found.seed is None else found.seed
    spec = spec_of(made, seed, found.until)
    folder = folder_for([made], out, "explanation")

    def words(tried: int, faults: int) -> tuple[float, float, str]:
        return tried, runs, f"{tried:,} of at most {runs:,} runs, smallest set: {faults:,} faults"

    with bar(made.name) as show:
        answer = search(
            made,
            monitors_named(made, monitor, flag=flag),
            seed=seed,
            until=found.until,
            limit=runs,
            only=[only] if isinstance(only, str) else [*only],
            folder=folder,
            jobs=jobs,
            tell=telling(show, words, progress),
            command=["epicycle", "run", made.name, "--seed", str(seed)] if spec is None else spec.command(),
        )
    answer.folder = folder
    return answer


@checked
def rare(
    model: Annotated[Model | str | Path, argument(REFERENCE, "MODEL or RESULTS")],
    monitor: Annotated[
        str, option("a monitor of the model, or a property such as 'always server.size < 40'", NAME_OR_PROPERTY)
    ],
    *,
    guide: Annotated[
        str | None,
        option(
            "the one whose robustness says how close a run is to the break (default: the monitor)", NAME_OR_PROPERTY
        ),
    ] = None,
    runs: Annotated[int, option("runs from each level", "N", COUNT)] = 200,
    repetitions: Annotated[int, option("independent estimates", "N", COUNT)] = 10,
    seed: Annotated[int | None, SEED] = None,
    until: Annotated[float | str | None, UNTIL] = None,
    out: Annotated[str | Path | None, _out("rare")] = None,
    jobs: Annotated[int | None, JOBS] = None,
    progress: bool | Callable[[int, int], None] = True,
    **changes: Unpack[Changes],
) -> RareEvent:
    """Estimate how probable it is that a run breaks a property, however rare.

    Runs whose robustness falls to a level continue from there many times, each time with other random numbers
    (importance splitting).  The result is an unbiased estimate with a 95 % interval.  Each repetition is noted in the
    folder, so that an estimate that was interrupted continues.

    >>> epicycle.rare("mm1", "always server.size < 40", until="1 h").interval
    """
    from ...search.monitored import monitor_named
    from ...search.splitting import rare as search
    from ...support.bars import bar, telling

    found = opened(model, seed, until, changes)
    made = copy.copy(found.model)
    monitor, folder = monitor_named(made, monitor), folder_for([made], out, "rare")
    with bar(made.name) as show:
        answer = search(
            made,
            monitor,
            guide=None if guide is None else monitor_named(made, guide, "guide"),
            runs=runs,
            repetitions=repetitions,
            seed=found.seed,
            until=found.until,
            folder=folder,
            jobs=jobs,
            tell=telling(show, lambda tried, done: (done, repetitions, f"{tried:,} runs"), progress),
        )
    answer.folder = folder
    return answer
