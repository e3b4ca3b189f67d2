"""run a model"""

from __future__ import annotations

import argparse
import math
import threading
from collections.abc import Callable
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from ..printing import complain, console, notices, tell, tell_json
from .options import MODEL, SEED, command, complain_of, load, number, option, seconds, several

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import Console

    from ..build import Model

PATIENCE = 5.0  # s after which a run can be judged
LONG = 600.0  # s that are worth a word
NOTICEABLE = 0.05  # s by which a run may be late without our saying so: the operating system alone takes as much


def factor(text: str) -> float:
    """How many seconds of model time pass in a second."""
    from ..engine import SLOWEST

    if not SLOWEST <= (found := number(text)) < math.inf:
        # The model, perhaps, which stands behind the option.
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a number of {SLOWEST:g} or more (write MODEL before --realtime)"
        )
    return found


@command(
    "run a model",
    *MODEL,
    SEED,
    option("--until", metavar="TIME", help="stop time, such as 30 or '500 ms' (default: the model's)"),
    option(
        "--realtime",
        metavar="FACTOR",
        type=factor,
        nargs="?",
        const=1.0,
        help="let FACTOR seconds of model time pass in a second of the wall clock (default: 1), and no more",
    ),
    option(
        "--out",
        metavar="DIR",
        type=Path,
        help="folder for manifest, signals and figures (default: results/MODEL; with --json: none)",
    ),
    option("--log", metavar="FILE", type=Path, help="write the event log to FILE (.parquet, .csv or .jsonl)"),
    several(
        "--log-where",
        metavar="COLUMN=PATTERN",
        help="write only what fits, such as aspect=packet_loss, aspect='*' (all acts of aspects), event=dropped, "
        "actor='observer[*].**' or port=plan; of several for one column one must fit, and each column",
    ),
    option("--json", action="store_true", help="print one JSON object instead of the table"),
    imports=("build", "engine", "show"),
)
def run(options: argparse.Namespace) -> int:
    """Run a model once and report what came of it."""
    from epicycle.actors import EpicycleError

    from ..build import figures_of
    from ..engine import ActorError, LogFilter, LoopError, Pace, Simulation
    from ..results import LogFile
    from ..show import FigureError, check_folder, draw_figures, summary_object, summary_table, write_folder
    from ..text import Problems

    log = LogFile(options.log) if options.log is not None else None
    if log is None and options.log_where:
        raise EpicycleError(f"--log-where {options.log_where[0]} needs --log FILE, to which the log is written")
    log_filter = LogFilter.of(options.log_where)
    until = seconds("--until", options.until)
    model = load(options)
    figures = figures_of(model, Problems())
    folder = options.out or (None if options.json else Path("results") / model.name)
    if folder is not None and folder.exists() and not folder.is_dir():
        raise EpicycleError(f"--out {folder} is a file, not a folder")
    replaced = "" if folder is None else check_folder(folder, model.name, options.given)
    keep_log, log_to = (False, None) if log is None else (log_filter, log.add)
    simulation = Simulation(model, seed=options.seed, keep_log=keep_log, log_to=log_to)
    if replaced:  # and nothing is wrong with what was asked for
        complain(replaced)
    pace = Pace(options.realtime) if options.realtime is not None else None
    if until is None and model.endless:
        complain(f"{model.endless}\n   help: end it with Ctrl-C, which keeps what was recorded, or run it with --until")
    with log or nullcontext(), progress(model, until) as report:
        try:
            results = simulation.run(until=until, progress=report, pace=pace)
        except (ActorError, LoopError, KeyboardInterrupt) as error:
            interrupted = isinstance(error, KeyboardInterrupt)
            results = simulation.results("interrupted" if interrupted else "failed")
            if folder is not None:
                write_folder(folder, results, options.given, "interrupted" if interrupted else str(error))
                complain(f"what was recorded until then is in {folder}")
            raise
        # Before the log is closed, which may fail.
        saved = [] if folder is None else write_folder(folder, results, options.given)
    if pace is not None and pace.worst > NOTICEABLE:
        complain(
            f"the run could not keep up with the wall clock: {pace.worst:.3g} s late at worst, "
            f"{pace.behind:.3g} s at the end"
        )
    written, failed = [], list[FigureError]()
    if folder is not None:
        drawn, failed = draw_figures(folder, results, figures)
        written = [*drawn, *saved]
    if options.json:
        tell_json(summary_object(results))
    else:
        console().print(summary_table(model, results))
        for path in written:
            tell(f"wrote {path}")
    return complain_of(failed, options)


def outlook(elapsed: float, now: float, end: float) -> str:
    """What to say of a run that has gone on for a while and will take long: a clock of 1 ns is easily written."""
    if now <= 0.0:  # for all we know, one step does not end
        state = f"still at 0 s of {end:g} s"
    elif (left := elapsed * (end - now) / now) > LONG:
        state = f"at {now:.3g} s of {end:g} s: at this pace it takes {left / 3_600:,.1f} h more"
    else:
        return ""
    return f"after {elapsed:.0f} s the run is {state}; Ctrl-C ends it, and what was recorded is kept"


@contextmanager
def progress(model: Model, until: float | None) -> Iterator[Callable[[float], None]]:
    """A bar on a terminal's standard error, and notices of what takes long."""
    end = until if until is not None else model.stop
    latest = -math.inf

    def look(now: float) -> None:
        nonlocal latest
        if latest < 0.0:  # time starts only now: before, actors were initialised, which says nothing of the run
            watch.start()
        latest = now
        show(now)

    def judge() -> None:
        if end is not None and (text := outlook(PATIENCE, latest, end)):
            complain(text)

    terminal = console(stderr=True)
    drawn = _bar(terminal, model.name, end) if terminal.is_terminal else nullcontext(lambda now: None)
    # One step of the run may take for ever, so it is looked at from outside.
    watch = threading.Timer(PATIENCE, judge)
    watch.daemon = True
    try:
        with notices(terminal), drawn as show:
            yield look
    finally:
        watch.cancel()


@contextmanager
def _bar(terminal: Console, name: str, end: float | None) -> Iterator[Callable[[float], None]]:
    """A bar; the call that says how far the run is."""
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    about = TextColumn("{task.description} {task.fields[now]} s of model time", markup=False)
    with Progress(about, BarColumn(), TimeElapsedColumn(), console=terminal, transient=True) as bar:
        task = bar.add_task(name, total=end, now="0")
        yield lambda now: bar.update(task, completed=now, now=f"{now:.1f}" if now >= 1.0 else f"{now:.3g}")
