"""One run, from the model to the files of its results."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path

from epicycle.actors import EpicycleError

from ..execution.engine import ActorError, LogFilter, LoopError, Pace, Simulation
from ..execution.results import LogFile, Results
from ..model.build.figures import figures_of
from ..model.build.model import Model
from ..model.text.problems import Problems
from ..study.run_spec import spec_of
from ..support.bars import SOON
from ..support.printing import complain
from .outcome import check_folder, draw_figures, write_folder
from .watching import watched

NOTICEABLE = 0.05  # s by which a run may be late without a report: the operating system alone takes as much


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
    progress: bool = True,
    after: float = SOON,
    most: int | None = None,
) -> Done:
    """Run a model and write what is requested; ``given`` is the command, for the manifest.

    The records of a run that fails are written, too.  ``keep_log`` filters the ``log``, if there is one.  The run ends
    after ``most`` tags.
    """
    figures = figures_of(model, Problems())
    spec = spec_of(model, seed, until)
    given = given or (("epicycle.run", model.name) if spec is None else spec.command())
    if folder is not None and folder.exists() and not folder.is_dir():
        raise EpicycleError(f"--out {folder} is a file, not a folder")
    replaced = "" if folder is None else check_folder(folder, model.name, [*given])
    simulation = Simulation(model, seed=seed, keep_log=keep_log, log_to=None if log is None else log.add)
    if replaced:  # and the request is valid
        complain(replaced)
    if until is None and most is None and model.endless:
        complain(f"{model.endless}\n   help: end it with Ctrl-C, which keeps what was recorded, or run it with --until")
    with log or nullcontext(), watched(model, until, after) if progress else nullcontext() as report:
        try:
            results = simulation.run(until=until, progress=report, pace=pace, most=most)
        except (ActorError, LoopError, KeyboardInterrupt) as error:
            interrupted = isinstance(error, KeyboardInterrupt)
            results = simulation.results("interrupted" if interrupted else "failed")
            if folder is not None:
                why = "interrupted" if interrupted else str(error)
                write_folder(folder, results, given, why, spec)
                complain(f"what was recorded before is in {folder}")
            raise
        # Before the log is closed, which may fail.
        saved = [] if folder is None else write_folder(folder, results, given, spec=spec)
    if pace is not None and pace.worst > NOTICEABLE:
        complain(
            f"the run could not keep up with the wall clock: {pace.worst:.3g} s late at worst, "
            f"{pace.behind:.3g} s at the end"
        )
    if folder is None:
        return Done(results)
    drawn, failed = draw_figures(folder, results, figures)
    return Done(results, [*drawn, *saved], failed)
