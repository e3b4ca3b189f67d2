"""Damage to the files of a results folder is reported, and lost runs are repeated; no row ever changes."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from epicycle.actors import EpicycleError
from epicycle.runner.interface.cli import main
from epicycle.runner.study.judge.study_results import open_study
from epicycle.runner.study.run.locking import lock
from epicycle.runner.study.run.manifest import StoreError, checksum, manifest_text, read_manifest
from epicycle.runner.study.run.store import Store, prepare
from epicycle.runner.study.session import manifest_of, run_study
from tests.study.study_parts import plan_of, write

HELP = "   help: 'epicycle study out' sets it aside and repeats its lost runs"
ANEW = "   help: 'epicycle study STUDY --out out' rewrites it and keeps the existing runs"


def lines_of(rows: list[dict[str, Any]]) -> bytes:
    """A journal."""
    return b"".join(b"%s %s\n" % (checksum(text).encode(), text) for text in (json.dumps(row).encode() for row in rows))


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a study and its results, four of ten rows in a part and all others still in a journal."""
    folder = tmp_path_factory.mktemp("done")
    write(folder)
    out = folder / "out"
    run_study(plan_of(folder / "walks.yaml"), out, jobs=1)
    [part] = (out / "parts").iterdir()
    rows = pq.read_table(part).to_pylist()
    part.unlink()
    (out / "journals" / "left.jsonl").write_bytes(lines_of(rows[:4]))
    with lock(out):
        prepare(out, read_manifest(out))
    (out / "journals" / "behind.jsonl").write_bytes(lines_of(rows[4:]))
    assert len(open_study(out).table()) == 10
    assert open_study(out).is_written()
    return folder


@pytest.fixture
def copied(done: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    shutil.copytree(done, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def files_of(out: Path) -> list[Path]:
    return sorted(path for path in out.rglob("*") if path.is_file())


def are_among(found: Iterable[dict[str, Any]], whole: dict[str, dict[str, Any]]) -> bool:
    """Whether no row has changed."""
    return all(whole.get(row["run"]) == row for row in found)


@pytest.mark.slow
def test_flipped_bits_are_told_or_repaired(done: Path, tmp_path: Path) -> None:
    """300 bits, each in its own folder; some of the folders are resumed."""
    plan = plan_of(done / "walks.yaml")
    whole = {row["run"]: row for row in open_study(done / "out").table(times=True).to_pylist()}
    kept = {row["run"]: row for batch in Store(done / "out").rows() for row in batch.to_pylist()}
    table = (done / "out" / "table.parquet").read_bytes()
    random = np.random.default_rng(13)
    told = 0
    for trial in range(300):
        out = tmp_path / f"{trial}"
        shutil.copytree(done / "out", out)
        path = files_of(out)[trial % 5]
        data = bytearray(path.read_bytes())
        bit = int(random.integers(8 * len(data)))
        data[bit // 8] ^= 1 << bit % 8
        path.write_bytes(bytes(data))
        try:
            results = open_study(out)
            found = {row["run"]: row for row in results.table(times=True).to_pylist()}
        except StoreError as error:
            said = str(error)
        else:
            said = "" if results.is_written() else str(path)
            # The row whose end of line was hit has not been finished; any other one is there as it was.
            assert are_among(found.values(), whole)
            assert len(found) == 10 or (path.suffix == ".jsonl" and bit // 8 == len(data) - 1)
        told += said.startswith(str(path))
        assert said == "" or said.startswith(str(path)), (said, path)
        if trial < 5 or trial % 100 == 99:
            outcome = run_study(plan, out, jobs=1)
            assert outcome.made + outcome.there == 10
            assert (out / "table.parquet").read_bytes() == table, path
            assert open_study(out).is_written()
        else:
            with lock(out):
                left = prepare(out, manifest_of(plan)).rows()
            assert are_among((row for batch in left for row in batch.to_pylist()), kept)
    assert told >= 230  # what is harmless: the lock, and some white space of the manifest


def test_damaged_journal(copied: Path, capsys: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture) -> None:
    journal = copied / "out" / "journals" / "behind.jsonl"
    journal.write_bytes(journal.read_bytes().replace(b'"ok"', b'"OK"', 2))
    for command in ("status", "report"):
        assert main([command, "out"]) == 2
        assert capsys.readouterr().err == (
            f"error: out/journals/behind.jsonl is damaged: 2 lines of 6 with a wrong checksum\n{HELP}\n"
        )
    table = (copied / "out" / "table.parquet").read_bytes()
    assert (
        main(["study", "walks.yaml", "--types", str(plan_of(copied / "walks.yaml").study.types[0]), "--out", "out"])
        == 0
    )
    assert capsys.readouterr().out.startswith("walks: 2 conditions, 2 new runs, 8 already there\n")
    assert [record.getMessage() for record in caplog.records] == [
        (
            "out/journals/behind.jsonl is damaged: 2 lines of 6 with a wrong checksum; their runs are repeated\n"
            "   the damaged file is kept in out/damaged"
        )
    ]
    assert (copied / "out" / "table.parquet").read_bytes() == table
    assert [path.name for path in files_of(copied / "out" / "damaged")] == ["behind.jsonl"]


def test_damaged_manifest(copied: Path, capsys: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture) -> None:
    path = copied / "out" / "manifest.json"
    path.write_bytes(path.read_bytes().replace(b'"replications": 5', b'"replications": 4'))
    for command in ("status", "report", "study"):
        assert main([command, "out"]) == 2
        assert (
            capsys.readouterr().err == f"error: out/manifest.json is damaged: it does not match its checksum\n{ANEW}\n"
        )
    table = (copied / "out" / "table.parquet").read_bytes()
    outcome = run_study(plan_of(copied / "walks.yaml"), Path("out"), jobs=1)
    assert (outcome.made, outcome.there) == (0, 10)
    assert [record.getMessage() for record in caplog.records] == ["out/manifest.json is damaged and is being rewritten"]
    assert (copied / "out" / "table.parquet").read_bytes() == table


def test_a_broken_manifest_of_somebody_else_is_left_alone(copied: Path) -> None:
    (copied / "theirs").mkdir()
    (copied / "theirs" / "manifest.json").write_text("{")
    with pytest.raises(StoreError, match=r"^theirs/manifest\.json is damaged: Expecting property name"):
        run_study(plan_of(copied / "walks.yaml"), Path("theirs"), jobs=1)
    assert (copied / "theirs" / "manifest.json").read_text() == "{"


def test_damaged_table(copied: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = copied / "out" / "table.parquet"
    data = path.read_bytes()
    path.write_bytes(data[:50] + bytes([data[50] ^ 1]) + data[51:])
    assert main(["status", "out"]) == 0
    assert capsys.readouterr().out == (
        "walks: 10 of 10 runs are finished (10 ok)\n"
        "out/table.parquet does not match the runs: it is damaged or out of date\n"
        "   help: 'epicycle study out' rewrites it\n"
    )
    run_study(plan_of(copied / "walks.yaml"), Path("out"), jobs=1)
    assert path.read_bytes() == data


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
@pytest.mark.parametrize("kind", ["named pipe", "device"])
@pytest.mark.parametrize("name", ["parts/x.parquet", "journals/x.jsonl", "manifest.json", "lock", "table.parquet"])
def test_pipes_and_devices_hold_nobody_up(
    name: str, kind: str, copied: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = Path("out") / name
    path.unlink(missing_ok=True)
    if kind == "device":
        path.symlink_to("/dev/zero")
    else:
        os.mkfifo(path)
    said = f"error: out/{name} cannot be read: it is a {kind}, not a regular file\n"
    said = {"lock": "", "table.parquet": "", "manifest.json": f"{said}{ANEW}\n"}.get(name, f"{said}{HELP}\n")
    assert main(["status", "out"]) == (2 if said else 0)
    assert capsys.readouterr().err == said
    if name == "lock":
        with pytest.raises(StoreError, match=rf"^out/lock is a {kind}, not a regular file: delete it$"):
            run_study(plan_of(copied / "walks.yaml"), Path("out"), jobs=1)
        return
    outcome = run_study(plan_of(copied / "walks.yaml"), Path("out"), jobs=1)
    assert (outcome.made, outcome.there) == (0, 10)
    assert main(["status", "out"]) == 0


VALUES: tuple[Any, ...] = (
    None, True, 0, -1, 10**29, 1.5, "x", "\x1b[31m", [], ["x"], [None], [[]], [{}], {}, {"x": 1}, {"x": "x"},
    {"x": {"unit": "m", "doc": ""}}, [{"9" * 5_000: {}}], [{"x": {}}],
)  # fmt: skip


def edits(value: Any) -> Iterator[Any]:
    """A manifest with one change, at any depth."""
    yield from VALUES
    if isinstance(value, dict):
        for name in value:
            yield {each: value[each] for each in value if each != name}
            yield {(each + "x" if each == name else each): value[each] for each in value}
            for other in edits(value[name]):
                yield {**value, name: other}
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield [*value[:index], *value[index + 1 :]]
            for other in edits(item):
                yield [*value[:index], other, *value[index + 1 :]]


@pytest.mark.slow
def test_every_edit_of_a_manifest_gives_a_message(copied: Path) -> None:
    """Of any field to any type: by hand, and by somebody who corrects the checksum."""
    out = Path("out")
    path = out / "manifest.json"
    manifest = read_manifest(out)
    count = 0
    for edited in edits(manifest):
        path.write_text(json.dumps(edited))
        if edited == manifest:
            continue
        count += 1
        with pytest.raises(StoreError) as caught:
            read_manifest(out)
        if isinstance(edited, dict) and edited.keys() == manifest.keys():
            assert str(caught.value) == f"out/manifest.json is damaged: it does not match its checksum\n{ANEW}"
        if not isinstance(edited, dict):
            assert str(caught.value) == "out holds other results, not those of a study"
            continue
        path.write_text(manifest_text(edited))
        try:
            open_study(out).table()
        except EpicycleError as error:
            assert str(error)  # noqa: PT017
    assert count > 974
    path.write_text("[" * 100_000)
    with pytest.raises(StoreError) as caught:
        read_manifest(out)
    assert str(caught.value) == f"out/manifest.json is damaged: it is nested too deep\n{ANEW}"


@pytest.mark.parametrize("text", [b'["x"]', b"\xff", b"{"])
def test_a_line_with_the_right_checksum_that_is_no_row(
    copied: Path, capsys: pytest.CaptureFixture[str], text: bytes
) -> None:
    journal = copied / "out" / "journals" / "behind.jsonl"
    journal.write_bytes(journal.read_bytes() + b"%s %s\n" % (checksum(text).encode(), text))
    assert main(["status", "out"]) == 2
    assert (
        capsys.readouterr().err == f"error: out/journals/behind.jsonl is damaged: 1 line of 7 cannot be read\n{HELP}\n"
    )


def test_a_part_with_the_right_checksum_that_is_no_table(copied: Path, capsys: pytest.CaptureFixture[str]) -> None:
    [part] = (copied / "out" / "parts").iterdir()
    part.unlink()
    (copied / "out" / "parts" / f"a-{checksum(b'')}.parquet").write_bytes(b"")
    assert main(["status", "out"]) == 2
    assert capsys.readouterr().err == (
        f"error: out/parts/a-{checksum(b'')}.parquet is damaged: Parquet file size is 0 bytes\n{HELP}\n"
    )
