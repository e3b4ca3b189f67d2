"""Stores of results: tables, parts, journals and signals in which bytes or values were changed."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
from pyarrow import parquet

from epicycle.runner.interface.cli import main
from epicycle.runner.study.run.manifest import checksum
from tests.fuzz.surfaces.case import Answer, Case, Surface, chosen, spoiled
from tests.fuzz.surfaces.manifests import commands, make_results

_JOURNAL = (b'{"run": "a", "last": 3.0}', b'["x", 1]', b'{"run": 1e999, "seed": "a"}', b"\x00\xff")


def _prepare(home: Path) -> None:
    if (made := home.parent / "manifests").exists():
        shutil.copytree(made, home, dirs_exist_ok=True)
    else:
        make_results(home)
    main(["status", str(home / "study"), "--conditions", "--json"])


def _changed(file: Path, random: np.random.Generator) -> None:
    """A value of a table is another one, and the file is as whole as before."""
    import pandas

    table = pandas.read_parquet(file)
    if table.empty:
        return
    column = str(chosen(random, list(table.columns)))
    row = int(random.integers(len(table)))
    values = table[column].tolist()
    values[row] = chosen(random, (0, -1, 1e300, float("nan"), "a", None, True)) if random.random() < 0.5 else values[0]
    try:
        table[column] = values
        table.to_parquet(file)
    except (ValueError, TypeError, OverflowError, OSError):  # pyarrow's refusals of mixed columns are of all these
        file.write_bytes(b"")


def _numbers(results: Path) -> list[dict[str, object]]:
    """What a study has found, without how long it took."""
    rows = parquet.read_table(results / "table.parquet").to_pylist()
    return [{name: value for name, value in row.items() if "wall" not in name} for row in rows]


def _other_numbers(answer: Answer, results: Path, good: Path) -> str:
    """What is wrong with a study that was resumed after an accident: numbers that nobody has computed."""
    if answer.code != 0 or _numbers(results) == _numbers(good):
        return ""
    return "the table has other numbers than before"


def _make(random: np.random.Generator, home: Path, folder: Path) -> Case:
    kind = "run" if random.random() < 0.2 else "study"
    results = folder / kind
    shutil.copytree(home / kind, results, ignore=shutil.ignore_patterns("figures", "report.html"))
    files = sorted(each for each in results.rglob("*") if each.is_file() and each.name not in ("manifest.json", "lock"))
    file, is_forged = Path(chosen(random, files)), False
    if random.random() < 0.2:
        is_forged = True
        (results / "journals").mkdir(exist_ok=True)
        lines = (spoiled(line, random) for line in _JOURNAL)
        data = b"".join(b"%s %s\n" % (checksum(line).encode(), line) for line in lines)
        (results / "journals" / f"{chosen(random, 'abc')}.jsonl").write_bytes(data)
    elif file.suffix == ".parquet" and random.random() < 0.5:
        _changed(file, random)
    else:
        file.write_bytes(spoiled(file.read_bytes(), random))
    if file.parent.name == "parts" and random.random() < 0.7:  # whoever changes a part can compute its checksum
        is_forged = True
        file.rename(file.with_name(f"{file.stem.rpartition('-')[0]}-{checksum(file.read_bytes())}.parquet"))
    arguments = commands(random, results, kind)
    if is_forged or arguments[0] != "study":
        return Case(arguments)
    return Case(arguments, lambda answer: _other_numbers(answer, results, home / kind))


SURFACE = Surface("stores", _prepare, _make)
