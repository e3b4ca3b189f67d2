"""The results folder of a run: manifest, signals, figures."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from pathlib import Path

from ..engine import Results
from ..provenance import versions
from .figures import Figure
from .summary import summary_object


def write_folder(
    folder: Path, results: Results, figures: dict[str, Figure], command: Iterable[str], error: str = ""
) -> list[Path]:
    """Write ``manifest.json``, ``signals.parquet`` and a PNG for each figure; the files that were written.

    Each file is written aside and then moved into place, so a folder never holds half a file.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name, figure in figures.items():
        written.append(folder / f"{name}.png")
        aside = folder / f".{name}.png"
        figure.draw(results, aside)
        os.replace(aside, written[-1])
    written.append(folder / "signals.parquet")
    write_signals(results, written[-1])
    written.append(folder / "manifest.json")
    manifest = {**summary_object(results), "command": list(command), "versions": versions()}
    if error:
        manifest["error"] = error
    aside = folder / ".manifest.json"
    aside.write_text(json.dumps(manifest, indent=2) + "\n", encoding="utf-8")
    os.replace(aside, written[-1])
    return written


def write_signals(results: Results, path: Path) -> None:
    """The recorded signals in long form: time, microstep, signal, field, value."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    types = {
        "time": pa.float64(),
        "microstep": pa.int64(),
        "signal": pa.dictionary(pa.int32(), pa.string()),
        "field": pa.dictionary(pa.int32(), pa.string()),
        "value": pa.float64(),
    }
    columns = results.table()
    table = pa.table({name: pa.array(columns[name], type=kind) for name, kind in types.items()})
    aside = path.with_name(f".{path.name}")
    pq.write_table(table, aside)
    os.replace(aside, path)
