"""One run: make it, trace it, look at it."""

from __future__ import annotations

import argparse
import webbrowser
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from ...support.declare.commands import arguments
from ...support.extras import needed
from ...support.printing import console, tell, tell_json
from ..calls import running
from .options import (
    BROKEN,
    DONE,
    FAILED,
    check_path,
    command,
    complain_of,
    complain_of_change,
    open_run,
    option,
    several,
    taken,
)

if TYPE_CHECKING:
    from ...model.build.model import Model
    from ...show.view.recording import Recording


@command(
    "run a model, or a run again",
    taken(running.run),
    several(
        "--log-where",
        metavar="COLUMN=PATTERN",
        help="write only matching records, such as aspect=packet_loss, aspect='*' (all doings of aspects), "
        "event=dropped, actor='observer[*].**' or port=plan; may be repeated: a record must match one pattern of "
        "each column that has any",
    ),
    option("--json", action="store_true", help="print one JSON object instead of the table"),
    option("--check", action="store_true", help="exit with code 3 if a monitor of the model is broken"),
    option(
        "--trace",
        metavar="ACTORS",
        action="append",
        nargs="?",
        const="**",
        help="print who fired when, and why, in place of the results: actors such as main.sensor, "
        "'observer[*].sensor' or a whole composite (default: all); may be repeated; write MODEL before it; with "
        "--json, an object per line",
    ),
    option("--from", dest="start", metavar="TIME", help="with --trace: first time to print (default: the start)"),
    option("--to", metavar="TIME", help="with --trace: last time to print (default: the end of the run)"),
    imports=("show.performing",),
)
def run(options: argparse.Namespace) -> int:
    """Run a model once and report the results.

    For a results folder, or a run of a study, the run is made again, with what else is said on top.
    """
    from epicycle.actors import EpicycleError

    from ...execution.engine import LogFilter, Pace
    from ...execution.results import LogFile
    from ...show.outcome import summary_object, summary_table
    from ...show.performing import perform

    given = arguments(running.run, options)
    path, pace, out = given.get("log"), given.get("realtime"), given.get("out")
    if options.trace:
        if told := [flag for flag, value in (("--log", path), ("--realtime", pace), ("--out", out)) if value]:
            raise EpicycleError(f"--trace prints a run and writes nothing: without {', '.join(told)}")
        from .tracing import trace

        made = open_run(options, running.run, options.model)
        trace(made, options.trace, options.start, options.to, as_json=options.json)
        return DONE
    if told := [flag for flag, value in (("--from", options.start), ("--to", options.to)) if value is not None]:
        raise EpicycleError(f"{told[0]} is for --trace")
    log = None if path is None else LogFile(path)
    if log is None and options.log_where:
        raise EpicycleError(f"--log-where {options.log_where[0]} needs --log FILE, the file to write the log to")
    log_filter = LogFilter.of(options.log_where)
    made = open_run(options, running.run, options.model)
    model = made.model
    done = perform(
        model,
        seed=made.seed,
        until=made.until,
        pace=None if pace is None else Pace(pace),
        keep_log=False if log is None else log_filter,
        log=log,
        folder=out or (None if options.json else _folder_of(model)),
        given=options.given,
        after=0.0,
        most=given.get("max_tags"),
    )
    if options.json:
        tell_json(summary_object(done.results))
    else:
        console().print(summary_table(model, done.results))
        for each in done.written:
            tell(f"wrote {each}")
    has_changed = complain_of_change(options.model, made.digest, done.results.digest)
    errors = list(done.failed)
    if made.plan is not None:
        from ...study.run.runner import error_of_metrics

        errors += filter(None, [error_of_metrics(made.plan, done.results)])
    code = complain_of(errors, options)
    if made.plan is not None and has_changed:  # which nothing that was said can have changed
        code = FAILED
    broken = any(verdict.holds is False for verdict in done.results.monitors.values())
    return BROKEN if options.check and broken and not code else code


def _folder_of(model: Model) -> Path:
    from ...search.spec import results_folder
    from ...study.run_spec import spec_of

    spec = spec_of(model, None, None)
    return Path(spec.study) / "replays" / spec.run if spec and spec.study else results_folder(model.name)


@command(
    "show a run in a browser: space, graph, signals, and what caused what",
    taken(running.view),
    option(
        "-o",
        "--out",
        metavar="FILE",
        type=Path,
        help="write the page to FILE (default: results/MODEL/view.html, which is opened in the browser)",
    ),
    option("--mcap", metavar="FILE", type=Path, help="write the run for Foxglove or Lichtblick; no page without -o"),
    option("--rerun", metavar="FILE", type=Path, help="write the run for rerun; no page without -o"),
    imports=("show.view.pages",),
)
def view(options: argparse.Namespace) -> int:
    """Run a model and write a page that shows the run: it needs no network, and any browser opens it.

    For a results folder, its run is repeated, with what else is said on top.  Two runs are shown side by side, with the
    first difference between them.  --mcap and --rerun write the run for other viewers.
    """
    from epicycle.actors import EpicycleError

    from ...search.spec import results_folder
    from ...show.view.pages import recorded

    if len(options.models) > 2:
        raise EpicycleError(f"a page shows one run or two, not {len(options.models)}: {', '.join(options.models)}")
    check_path("--out", options.out)
    exports = _exports(options)
    runs = [open_run(options, running.view, name) for name in options.models]
    made = recorded(runs, names=[Path(name).name.removesuffix(".yaml") for name in options.models])
    for name, run, recording in zip(options.models, runs, made.recordings, strict=False):
        if not made.errors and recording.results is not None:
            complain_of_change(name, run.digest, recording.results.digest)
    for path, write in exports:
        write(made.recordings[0], path)
        tell(f"wrote {path}")
    page = options.out
    if page is None and not exports:
        page = results_folder(made.recordings[0].model.name) / "view.html"
        page.parent.mkdir(parents=True, exist_ok=True)
    if page is not None:
        made.save(page)
        tell(f"wrote {page}")
    if made.errors:
        raise made.errors[0]
    if page is not None and options.out is None:
        webbrowser.open(page.resolve().as_uri())
    return DONE


def _exports(options: argparse.Namespace) -> list[tuple[Path, Callable[[Recording, Path], None]]]:
    """The files for other viewers and the functions that write them; obstacles are reported before a run."""
    from epicycle.actors import EpicycleError

    room = "epicycle.runner.show.view"
    found: list[tuple[Path, Callable[[Recording, Path], None]]] = []
    for extra, path, what in (
        ("mcap", options.mcap, "an MCAP file"),
        ("rerun", options.rerun, "a recording for rerun"),
    ):
        if path is None:
            continue
        if len(options.models) > 1:
            raise EpicycleError(f"--{extra} writes one run, not two: {', '.join(options.models)}")
        check_path(f"--{extra}", path)
        module = needed(f"{room}.{extra}_file", what, extra)
        found.append((path, getattr(module, f"write_{extra}")))
    return found
