"""One run, from the model to the files of its results: what ``epicycle.run`` and the command do."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Unpack

from epicycle.actors import EpicycleError

from ..bars import SOON, bar
from ..build.figures import figures_of
from ..build.load import load_model
from ..build.model import Model
from ..engine import ActorError, LogFilter, LoopError, Pace, Simulation
from ..printing import complain, console, notices
from ..results import LogFile, Results
from ..shown import in_time
from ..text.problems import Problems
from .run_spec import Changes, RunSpec, seconds

PATIENCE = 5.0  # s after which the length of a run can be judged
LONG = 600.0  # s that are worth a notice
NOTICEABLE = 0.05  # s by which a run may be late without a report: the operating system alone takes as much

load = load_model


def loaded(model: Model | str | Path, changes: Changes) -> Model:
    """The model of that name or file with the changes; an existing model takes none."""
    if not isinstance(model, Model):
        return load_model(model, **changes)
    if changes:
        raise EpicycleError(
            f"the model {model.name} exists already and takes no {', '.join(changes)}\n"
            "   help: give the name or file of the model instead, or pass them to load"
        )
    return model


def run(
    model: Model | str | Path,
    *,
    seed: int | None = None,
    until: float | str | None = None,
    realtime: float | None = None,
    keep_log: bool = False,
    log: str | Path | None = None,
    out: str | Path | None = None,
    progress: bool = True,
    **changes: Unpack[Changes],
) -> Results:
    """Run a model once: a packaged one, a file, or a loaded or built model.

    ``set``, ``disturb`` and the other options of ``load`` change it first.  ``until`` is the stop time (s, or a text
    with a unit), ``realtime`` the seconds of model time that pass per second.  ``keep_log`` keeps the event log in
    ``results.log``, ``log`` writes it to a file (.parquet, .csv, .jsonl), ``out`` writes manifest, signals and figures
    into a folder.  A long run shows a bar in a notebook or on a terminal, unless ``progress`` is false.

    >>> epicycle.run("mm1", seed=3, set={"load": 0.9}).metrics["mean_wait"]
    """
    made = loaded(model, changes)
    spec = None if isinstance(model, Model) else RunSpec.of(model, seed, until, changes)
    done = perform(
        made,
        seed=seed,
        until=seconds("until", until),
        pace=None if realtime is None else Pace(realtime),
        keep_log=keep_log or log is not None,
        log=None if log is None else LogFile(Path(log)),
        folder=None if out is None else Path(out),
        given=("epicycle.run", made.name) if spec is None else spec.command(),
        spec=spec,
        progress=progress,
    )
    for error in done.failed:
        raise error
    return done.results


@dataclass
class Done:
    """The outcome of a run, the files written, and the figures that could not be drawn."""

    results: Results
    written: list[Path] = field(default_factory=list)
    failed: Sequence[EpicycleError] = ()


def perform(
    model: Model,
    *,
    seed: int | None = None,
    until: float | None = None,
    pace: Pace | None = None,
    keep_log: bool | LogFilter = False,
    log: LogFile | None = None,
    folder: Path | None = None,
    given: Sequence[str] = (),
    spec: RunSpec | None = None,
    progress: bool = True,
    after: float = SOON,
) -> Done:
    """Run a model and write what is requested; ``given`` is the command or call, and ``spec`` how to make the run
    again, for the manifest.

    The records of a run that fails are written, too.  ``keep_log`` filters the ``log``, if there is one.
    """
    figures = figures_of(model, Problems())
    if folder is not None and folder.exists() and not folder.is_dir():
        raise EpicycleError(f"--out {folder} is a file, not a folder")
    if folder is not None:
        from ..show import check_folder, draw_figures, write_folder

    replaced = "" if folder is None else check_folder(folder, model.name, list(given))
    simulation = Simulation(model, seed=seed, keep_log=keep_log, log_to=None if log is None else log.add)
    if replaced:  # and the request is valid
        complain(replaced)
    if until is None and model.endless:
        complain(f"{model.endless}\n   help: end it with Ctrl-C, which keeps what was recorded, or run it with --until")
    with log or nullcontext(), watched(model, until, after) if progress else nullcontext() as report:
        try:
            results = simulation.run(until=until, progress=report, pace=pace)
        except (ActorError, LoopError, KeyboardInterrupt) as error:
            interrupted = isinstance(error, KeyboardInterrupt)
            results = simulation.results("interrupted" if interrupted else "failed")
            if folder is not None:
                write_folder(folder, results, given, "interrupted" if interrupted else str(error), again(spec, results))
                complain(f"what was recorded before is in {folder}")
            raise
        # Before the log is closed, which may fail.
        saved = [] if folder is None else write_folder(folder, results, given, again=again(spec, results))
    if pace is not None and pace.worst > NOTICEABLE:
        complain(
            f"the run could not keep up with the wall clock: {pace.worst:.3g} s late at worst, "
            f"{pace.behind:.3g} s at the end"
        )
    if folder is None:
        return Done(results)
    drawn, failed = draw_figures(folder, results, figures)
    return Done(results, [*drawn, *saved], failed)


def again(spec: RunSpec | None, results: Results) -> dict[str, object] | None:
    """How to make a run again, for its manifest: with its seed, which the model may change."""
    return None if spec is None else (spec if spec.study else replace(spec, seed=results.seed)).plain()


def outlook(elapsed: float, now: float, end: float) -> str:
    """The notice about a run that has taken a while and will take long: a clock of 1 ns is easily written."""
    if now <= 0.0:  # perhaps a single step does not end
        state = f"still at 0 s of {end:g} s"
    elif (left := elapsed * (end - now) / now) > LONG:
        state = f"at {now:.3g} s of {end:g} s: at this pace it takes another {left / 3_600:,.1f} h"
    else:
        return ""
    return f"after {elapsed:.0f} s the run is {state}; Ctrl-C ends it, and what was recorded is kept"


@contextmanager
def watched(model: Model, until: float | None, after: float = 0.0) -> Iterator[Callable[[float], None]]:
    """Shows the progress of a run: a bar, and notices if it takes long."""
    end = until if until is not None else model.stop
    latest = -math.inf

    def look(now: float) -> None:
        nonlocal latest
        if latest < 0.0:  # time starts only now: before, actors were initialised, which says nothing about the run
            watch.start()
        latest = now
        if show is not None:
            show(now, end, f"{in_time(round(now, 1) if now >= 1.0 else now)} of model time")

    def judge() -> None:
        if end is not None and (text := outlook(PATIENCE, latest, end)):
            complain(text)

    # A step of the run may never end, so another thread watches it.
    watch = threading.Timer(PATIENCE, judge)
    watch.daemon = True
    terminal = console(stderr=True)
    try:
        with notices(terminal), bar(model.name, after=after, terminal=terminal) as show:
            if show is not None:
                show(0.0, end, "0 s of model time")
            yield look
    finally:
        watch.cancel()
