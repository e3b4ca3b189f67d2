"""The results folder: whose it is, what it takes, and what is left of what was broken off."""

from __future__ import annotations

import errno
import json
import os
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from epicycle.runner import open_study
from epicycle.runner.interface.cli import main
from epicycle.runner.study.run import store as store_module
from epicycle.runner.study.run.locking import lock
from epicycle.runner.study.run.manifest import checksum, manifest_text
from epicycle.runner.study.run.store import Store, Writer, prepare
from epicycle.runner.study.session import manifest_of, run_study
from tests.study.study_commands import message, study
from tests.study.study_parts import STUDY, plan_of, write

OTHER_FORMAT = "\n   help: pandas can read its table.parquet; to continue, repeat its runs in another folder"
MADE_ANEW = "\n   help: 'epicycle study STUDY --out mine' rewrites it and keeps the existing runs"


def test_folder_of_another_study(copied: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(copied, STUDY.replace("study: walks", "study: strolls"))
    assert study(copied) == 2
    assert message(capsys, copied) == (
        "error: out holds results of the study 'walks', not of 'strolls'\n   help: choose another folder with --out\n"
    )
    write(copied, STUDY.replace("  place: place\n", "  highest: highest\n"))
    assert study(copied) == 2
    assert message(capsys, copied) == (
        "error: out was made when walks had different metrics: place, lost (aspects['loss']['dropped']), mean_place "
        "(sum(signals['walk.output']['value']) / len(signals['walk.output']['value'])), not highest, lost "
        "(aspects['loss']['dropped']), mean_place (sum(signals['walk.output']['value']) / "
        "len(signals['walk.output']['value']))\n   help: choose another folder with --out\n"
    )
    write(copied)
    (copied / "mine").mkdir()
    (copied / "mine" / "letter.txt").write_text("Dear")
    assert study(copied, out="mine") == 2
    assert message(capsys, copied) == (
        "error: mine is not empty, and holds no results of a study\n   help: choose another folder with --out\n"
    )
    (copied / "mine" / "manifest.json").write_text('{"model": "mm1"}')
    assert study(copied, out="mine") == 2
    assert message(capsys, copied) == "error: mine holds other results, not those of a study\n"
    manifest = json.loads((copied / "out" / "manifest.json").read_text())
    for spoiled, said in (
        (manifest | {"format": 2}, f"mine has format 2, but this Epicycle reads format 4{OTHER_FORMAT}"),
        (
            {key: manifest[key] for key in manifest if key != "text"},
            f"mine/manifest.json is damaged: it has no 'text'{MADE_ANEW}",
        ),
    ):
        (copied / "mine" / "manifest.json").write_text(manifest_text(spoiled))
        assert main(["status", str(copied / "mine")]) == 2
        assert message(capsys, copied) == f"error: {said}\n"
    with lock(copied / "out"):
        assert study(copied) == 2
    said = message(capsys, copied)
    assert said == f"error: out is in use: another process is writing to it (pid {os.getpid()})\n"
    assert main(["status", str(copied / "nothing")]) == 2
    assert message(capsys, copied) == "error: there is no folder nothing\n"
    assert main(["run", str(copied / "out" / "abc")]) == 2
    assert message(capsys, copied) == (
        "error: out has no run 'abc'\n   help: the column 'run' of out/table.parquet lists their names\n"
    )


@pytest.mark.slow
def test_truncated_part(copied: Path, capsys: pytest.CaptureFixture[str]) -> None:
    part = next((copied / "out" / "parts").glob("*.parquet"))
    lost = pq.read_metadata(part).num_rows
    part.write_bytes(part.read_bytes()[:-20])
    assert main(["status", str(copied / "out")]) == 2
    assert message(capsys, copied) == (
        f"error: out/parts/{part.name} is damaged: it does not match its checksum\n"
        "   help: 'epicycle study out' sets it aside and repeats its lost runs\n"
    )
    assert study(copied) == 0
    assert [path.name for path in (copied / "out" / "damaged").iterdir()] == [part.name]
    new = f"{lost} new run{'s' if lost > 1 else ''}"
    assert capsys.readouterr().out.startswith(f"walks: 2 conditions, {new}, {10 - lost} already there\n")


def test_a_line_that_is_not_whole_was_not_finished(copied: Path, done: Path) -> None:
    plan = plan_of(copied / "walks.yaml")
    store = Store(copied / "out")
    rows = [row for batch in store.rows() for row in batch.to_pylist()]
    for part in (copied / "out" / "parts").iterdir():
        part.unlink()
    lines = [f"{checksum(text.encode())} {text}" for text in map(json.dumps, rows)]
    # The same row twice, as if killed between the journal's part and its end; and half a row.
    (copied / "out" / "journals" / "a.jsonl").write_text("\n".join([*lines[:4], lines[0], lines[5][:-9]]))
    (copied / "out" / "parts" / ".b.parquet.77").write_text("half a part")
    assert len(open_study(copied / "out").table()) == 4
    assert run_study(plan, copied / "out", jobs=1).made == 6
    assert (copied / "out" / "table.parquet").read_bytes() == (done / "out" / "table.parquet").read_bytes()
    assert [path.name for path in (copied / "out" / "parts").iterdir() if path.name.startswith(".")] == []


@pytest.mark.slow
def test_full_disk_leaves_nothing_half(
    copied: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = plan_of(copied / "walks.yaml")
    (copied / "full").mkdir()
    store = prepare(copied / "full", manifest_of(plan))
    rows = [row for batch in Store(copied / "out").rows() for row in batch.to_pylist()]
    writer = Writer(store)
    writer.add(rows[0])
    real = os.write

    def full(handle: int, data: bytes) -> int:
        if room.pop(0):
            return real(handle, data[: len(data) // 2])
        raise OSError(errno.ENOSPC, "No space left on device")

    room = [True, False]
    monkeypatch.setattr(store_module.os, "write", full)
    with pytest.raises(OSError, match="No space left"):
        writer.add(rows[1])
    monkeypatch.setattr(store_module.os, "write", real)
    assert [row["run"] for batch in store.rows() for row in batch.to_pylist()] == [rows[0]["run"]]
    writer.add(rows[2])
    monkeypatch.setattr(pq, "write_table", _refuse)
    with pytest.raises(OSError, match="No space left"):
        writer.flush()
    assert list((copied / "full" / "parts").iterdir()) == []
    # What the command says of it.
    assert study(copied, "--replications", 6) == 1
    assert message(capsys, copied) == (
        "error: cannot write to out: No space left on device\n"
        "   help: finished runs are kept; 'epicycle study out' continues\n"
    )
    monkeypatch.undo()
    writer.flush()
    assert [row["run"] for batch in store.rows() for row in batch.to_pylist()] == [rows[0]["run"], rows[2]["run"]]
    assert study(copied, "--replications", 6) == 0
    assert capsys.readouterr().out.startswith("walks: 2 conditions, 0 new runs, 12 already there\n")


def test_folder_that_takes_nothing_from_the_start(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path)
    (tmp_path / "letter.txt").write_text("Dear")
    assert study(tmp_path, out="letter.txt/out") == 1
    assert message(capsys, tmp_path) == "error: cannot write to letter.txt/out: Not a directory\n"


def _refuse(*_: object) -> None:
    raise OSError(errno.ENOSPC, "No space left on device")
