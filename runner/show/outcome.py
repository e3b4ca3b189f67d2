"""The output of a run: its summary for people and programs, and its folder with manifest, signals and figures."""

from __future__ import annotations

import json
import os
import shlex
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from rich.console import Group
from rich.text import Text

from epicycle.actors import EpicycleError, abridged, read_regular, shortened, visible

from ..execution.results import Results, plain, write_signals
from ..model.build.model import Model
from ..model.catalogue.figure import Figure
from ..model.graph.woven import extent
from ..study.provenance import versions
from ..study.run_spec import RunSpec
from ..support.files import replace_file
from ..support.printing import columns
from ..support.shown import finite, in_time, in_words
from .canvas import FigureError, draw

MAX_NAME = 60  # characters of a file name; file systems limit it
WIDEST = 400  # characters of a text in the table


def summary_object(results: Results) -> dict[str, Any]:
    """The output of ``--json``; NaN and infinities, which JSON lacks, become null."""
    result: dict[str, Any] = finite(
        {
            "model": results.model,
            "seed": results.seed,
            "parameters": {name: plain(value) for name, value in results.parameters.items()},
            "metrics": {name: plain(value) for name, value in results.metrics.items()},
            "monitors": {name: plain(each.plain()) for name, each in results.monitors.items()},
            "outcomes": {name: said for name, each in results.outcomes.items() if (said := each.plain())},
            "aspects": results.aspects,
            "stopped": results.stopped,
            "end": results.end,
            "until": results.until,
            "events": results.events,
            "wall_time": round(results.wall_time, 6),
            "digest": results.digest,
        }
    )
    return result


def summary_table(model: Model, results: Results) -> Group:
    """The summary printed at the end of a run."""
    head = Text.assemble(
        (visible(results.model), "bold"),
        f"  seed {results.seed}, {in_time(results.until)} of model time, ended by {visible(results.stopped)}",
    )
    rows = []
    for metric in model.output.metrics:
        found = results.outcomes[metric.name]
        said = "; ".join([metric.measure.doc, *found.remarks] if metric.measure.doc else found.remarks)
        unit = "" if metric.unit == "1" else metric.unit
        rows.append((metric.name, found.shown(shown), unit, said))
    for name, figures in results.aspects.items():
        woven = next(each for each in model.aspects if each.name == name)
        for what, figure in figures.items():
            where = f"by {woven.kind} at {extent([woven])}"
            rows.append((f"{name}: {what}", shown(figure), woven.aspect.reports.get(what, ""), where))
    rows += [
        ("events", f"{results.events}", "", "sends and events of aspects in the log"),
        ("firings", f"{results.firings}", "", "of actors"),
        ("wall time", f"{results.wall_time:.3f}", "s", "of initialisation and run"),
        ("digest", results.digest[:16] + "...", "", "SHA-256 of the event log, shortened"),
    ]
    cells = ([visible(shortened(text, WIDEST)) for text in row] for row in rows)
    table = columns(("metric", "value", "unit", ""), cells)
    table.columns[1].justify, table.columns[3].style = "right", "dim"
    return Group(head, table)


def shown(value: Any) -> str:
    """A metric's value in a few characters."""
    return in_words(plain(value), digits=4, nothing="-")


def check_folder(folder: Path, model: str, command: list[str]) -> str:
    """The message before a command replaces the results of another one in a folder.

    Raises ``EpicycleError`` if the folder holds results of another model, or of something else.
    """
    path = folder / "manifest.json"
    choose = "\n   help: choose another folder with --out, or delete this one"
    try:
        found = json.loads(read_regular(path))
        before, known = found["command"], found["model"]
        shown = shlex.join(before)
    except FileNotFoundError:
        return ""
    except (OSError, ValueError, LookupError, TypeError, RecursionError):
        raise EpicycleError(f"{folder} holds results that are not from a run{choose}") from None
    if known != model:
        raise EpicycleError(f"{folder} holds results of the model {known!r}, not {model!r}: {shown}{choose}")
    return "" if before == command else f"replacing the results of '{shown}' in {folder}"


def write_folder(
    folder: Path,
    results: Results,
    command: Iterable[str],
    error: str = "",
    spec: RunSpec | None = None,
) -> list[Path]:
    """Write ``manifest.json`` and ``signals.parquet``; returns the paths.

    ``spec`` says how the run is made.  Each file is written aside and then moved into place, so a folder never holds
    half a file.
    """
    folder.mkdir(parents=True, exist_ok=True)
    signals, manifest = folder / "signals.parquet", folder / "manifest.json"
    write_signals(results, signals)
    told = {**summary_object(results), "command": list(command), "versions": versions()}
    if spec is not None:  # to make it again: with its seed, which the model may change
        told["run"] = (spec if spec.study else replace(spec, seed=results.seed)).plain()
    if error:
        told["error"] = error
    replace_file(manifest, json.dumps(told, indent=2) + "\n")
    return [signals, manifest]


def draw_figures(folder: Path, results: Results, figures: dict[str, Figure]) -> tuple[list[Path], list[FigureError]]:
    """Draw a PNG for each figure, after everything else is saved; returns the files and the figures that failed."""
    written, failed = [], []
    for name, figure in figures.items():
        file = f"{abridged(name, MAX_NAME)}.png"
        aside = folder / f".{file}"
        try:
            draw(name, figure, results, aside)
        except FigureError as error:
            failed.append(error)
            aside.unlink(missing_ok=True)
        else:
            written.append(folder / file)
            os.replace(aside, written[-1])
    return written, failed
