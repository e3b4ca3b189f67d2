"""The results folder of a run: manifest, signals, figures."""

from __future__ import annotations

import json
import os
import shlex
from collections.abc import Iterable
from pathlib import Path

from epicycle.actors import EpicycleError, abridged, read_regular

from ..catalogue import Figure
from ..provenance import versions
from ..results import Results, write_signals
from .drawing import FigureError, draw
from .summary import summary_object

MAX_NAME = 60  # letters of a file's name, which file systems bound


def check_folder(folder: Path, model: str, command: list[str]) -> str:
    """What is to be said before a command writes to a folder, as it replaces the results of another one.

    Raises ``EpicycleError`` where there are results of another model, or of something else.
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
        raise EpicycleError(f"{folder} holds other results than those of a run{choose}") from None
    if known != model:
        raise EpicycleError(f"{folder} holds results of the model {known!r}, not of {model!r}: {shown}{choose}")
    return "" if before == command else f"replacing the results of '{shown}' in {folder}"


def write_folder(folder: Path, results: Results, command: Iterable[str], error: str = "") -> list[Path]:
    """Write ``manifest.json`` and ``signals.parquet``; the files that were written.

    Each file is written aside and then moved into place, so a folder never holds half a file.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = [folder / "signals.parquet"]
    write_signals(results, written[-1])
    written.append(folder / "manifest.json")
    manifest = {**summary_object(results), "command": list(command), "versions": versions()}
    if error:
        manifest["error"] = error
    aside = folder / ".manifest.json"
    aside.write_text(json.dumps(manifest, indent=2) + "\n", encoding="utf-8")
    os.replace(aside, written[-1])
    return written


def draw_figures(folder: Path, results: Results, figures: dict[str, Figure]) -> tuple[list[Path], list[FigureError]]:
    """Draw a PNG for each figure, when all else is safe; the files that were written, and what could not be drawn."""
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
