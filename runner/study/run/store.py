"""The results folder of a study: parts that are only ever added, each whole; journals of what is not in one yet.

::

    manifest.json          what the study is, and what its results were made with
    parts/<name>-<checksum>.parquet
                           rows of runs; a part appears all at once, and is never changed
    journals/<name>.jsonl  the rows of a session since its last part, a line each: checksum, row
    table.parquet          all rows in the order of the plan, made at the end
    lock                   held by the process that writes
    damaged/               files that were not any more what was written

A run counts as finished when its line is in a journal, that is before anybody hears of it: the line is handed to the
operating system at once, where no ``kill`` can reach it, and brought to the disk at most once a second.  The next to
open the folder makes a part of every journal that was left behind.  A row that is in two places is one row.

The manifest has a checksum in it, a part in its name, a row of a journal before it, and no byte is believed before its
checksum is seen to be right.  Who only reads is told of damage; who continues with the study puts the damaged file
aside, and makes the runs that are not there any more.
"""

from __future__ import annotations

import io
import json
import logging
import os
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any
from uuid import uuid4

from epicycle.actors import counted, irregular, read_regular

from .backlog import FAILED, KILLED, OK, TIMEOUT, Done
from .manifest import DamagedError, StoreError, checksum, manifest_text, read_manifest, schema_of

if TYPE_CHECKING:
    import pyarrow as pa

try:
    import fcntl
except ImportError:  # Windows: nothing tells two processes that they write to one folder
    fcntl = None  # type: ignore[assignment]

_LOGGER = logging.getLogger("epicycle")

ROWS_OF_A_PART = 1_000
SECONDS_TO_THE_DISK = 1.0
BEST_FIRST = (OK, FAILED, TIMEOUT, KILLED)  # of two rows of one run, the better one counts

Row = dict[str, Any]


class WriteError(StoreError):
    """A results folder that takes nothing more."""


class Store:
    """A results folder that is open for reading; raises ``StoreError`` if it is none, or a broken one."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.manifest = read_manifest(folder)
        self.schema = schema_of(self.manifest)

    def rows(self, columns: list[str] | None = None) -> Iterator[pa.RecordBatch]:
        """All rows, part by part; those of a run that was written twice come twice."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        for path in sorted(self.folder.glob("parts/*.parquet")):
            data, damage = read_part(path)
            self._check(path, damage)
            with pq.ParquetFile(pa.BufferReader(data)) as file:
                if not file.schema_arrow.equals(self.schema):
                    told = f"{path} has not the columns of {self.folder}/manifest.json: it is of another study"
                    raise StoreError(told)
                yield from file.iter_batches(columns=columns)
        for path in sorted(self.folder.glob("journals/*.jsonl")):
            with suppress(FileNotFoundError):  # its writer has just made a part of it
                rows, damage = read_journal(path)
                self._check(path, damage)
                if rows:
                    yield pa.RecordBatch.from_pylist(rows, self.schema).select(columns or self.schema.names)

    def known(self, value: str | None = None) -> dict[str, Done]:
        """The runs that are there, by key; ``value`` names the metric that is wanted of each."""
        found: dict[str, Done] = {}
        for batch in self.rows(["run", "status", *([value] if value else [])]):
            for key, status, *number in zip(*(column.to_pylist() for column in batch.columns), strict=True):
                before = found.get(key)
                if before is None or BEST_FIRST.index(status) < BEST_FIRST.index(before.status):
                    found[key] = Done(status, *number)
        return found

    def _check(self, path: Path, damage: str) -> None:
        if damage:
            told = f"'epicycle resume {self.folder}' puts it aside and makes the runs anew that are lost with it"
            raise DamagedError(f"{path} {damage}\n   help: {told}")


# -- opening it to write ----------------------------------------------------------------------------------------------


def prepare(folder: Path, manifest: Mapping[str, Any]) -> Store:
    """Make a results folder, or see that one that is there holds results of the same study; journals become parts.

    Raises ``StoreError``.  The caller holds the lock, so that whoever has left a journal behind is gone.
    """
    path = folder / "manifest.json"
    another = "\n   help: choose another folder with --out"
    before: Mapping[str, Any] | None = None
    if path.exists():
        try:
            before = read_manifest(folder)
        except DamagedError:
            if not (folder / "parts").is_dir():  # it may never have been ours
                raise
            _LOGGER.warning("%s is damaged: it is written anew", path)
    elif folder.is_dir() and any(
        each.name not in ("lock", "parts", "journals", "damaged") and not each.name.startswith(".manifest.json")
        for each in folder.iterdir()
    ):
        raise StoreError(f"{folder} is not empty, and holds no results of a study{another}")
    if before is not None:
        name = manifest["study"]
        if before["study"] != name:
            raise StoreError(f"{folder} holds results of the study {before['study']!r}, not of {name!r}{another}")
        for what in ("factors", "metrics"):
            if list(before[what].items()) != list(manifest[what].items()):
                had, has = _shown(before[what]), _shown(manifest[what])
                raise StoreError(f"{folder} was made when {name} had other {what}: {had}, not {has}{another}")
    with writing(folder):
        for name in ("parts", "journals"):
            (folder / name).mkdir(exist_ok=True)
        _replace(path, manifest_text(manifest).encode())
        for pattern in ("parts/.*.parquet.*", ".manifest.json.*", ".table.parquet.*"):
            for aside in folder.glob(pattern):
                aside.unlink()  # what somebody was writing when killed
        store = Store(folder)
        for part in sorted(folder.glob("parts/*.parquet")):
            if damage := read_part(part)[1]:
                _put_aside(part, f"{damage}; its runs are made anew")
        for journal in sorted(folder.glob("journals/*.jsonl")):
            if kind := irregular(journal):
                _put_aside(journal, f"is {kind}")
                continue
            rows, damage = read_journal(journal)
            if rows:
                write_part(store, journal.stem, rows)
            if damage:
                _put_aside(journal, f"{damage}; their runs are made anew")
            else:
                journal.unlink()
    return store


def _shown(columns: Mapping[str, str]) -> str:
    return ", ".join(name if name == what else f"{name} ({what})" for name, what in columns.items()) or "none"


def _put_aside(path: Path, damage: str) -> None:
    """Keep a damaged file where it does no harm, and say so."""
    aside = path.parent.parent / "damaged"
    aside.mkdir(exist_ok=True)
    os.replace(path, aside / path.name)
    _LOGGER.warning("%s %s\n   what is damaged is kept in %s", path, damage, aside)


@contextmanager
def lock(folder: Path) -> Iterator[None]:
    """Keep others from writing to a results folder; the lock ends with the process, however it ends."""
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        if (folder / "lock").exists() and (kind := irregular(folder / "lock")):
            raise StoreError(f"{folder / 'lock'} is {kind}: delete it")
        file = (folder / "lock").open("a+")
    with file:
        if not _is_locked(file):
            file.seek(0)
            raise StoreError(f"{folder} is being written by another process ({file.read().strip()})")
        file.truncate(0)
        file.write(f"pid {os.getpid()}\n")
        file.flush()
        yield


def is_running(folder: Path) -> bool:
    """Whether somebody holds the lock."""
    if not (folder / "lock").is_file():
        return False
    with (folder / "lock").open("a+") as file:
        return not _is_locked(file)


def _is_locked(file: IO[str]) -> bool:
    """Lock a file, if nobody else has."""
    try:
        if fcntl is not None:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


# -- writing ----------------------------------------------------------------------------------------------------------


@contextmanager
def writing(folder: Path) -> Iterator[None]:
    """Tell of a full disk, missing rights and the like in one sentence: raise ``WriteError``."""
    try:
        yield
    except OSError as error:
        message = f"cannot write to {folder}: {error.strerror or error}"
        if (folder / "manifest.json").is_file():  # something has begun
            message += f"\n   help: what was finished is kept; 'epicycle resume {folder}' goes on"
        raise WriteError(message) from error


class Writer:
    """Writes rows; raises ``OSError`` if it cannot, and then nothing half is left."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._rows: list[Row] = []
        self._journal: int | None = None
        self._path = store.folder
        self._synced = 0.0

    def add(self, row: Row) -> None:
        """Write a row; when this returns, the row outlives the process."""
        if self._journal is None:
            self._path = self._store.folder / "journals" / f"{uuid4().hex}.jsonl"
            self._journal = os.open(self._path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
            _sync_folder(self._path.parent)
        text = json.dumps(row).encode()
        line = b"%s %s\n" % (checksum(text).encode(), text)
        size = os.fstat(self._journal).st_size
        try:
            if os.write(self._journal, line) < len(line):  # the disk is full: the next try says so
                os.write(self._journal, line)
                raise OSError("only a part of a row could be written")
        except OSError:
            with suppress(OSError):
                os.ftruncate(self._journal, size)
            raise
        self._rows.append(row)
        if (now := time.monotonic()) - self._synced > SECONDS_TO_THE_DISK:
            os.fsync(self._journal)
            self._synced = now
        if len(self._rows) >= ROWS_OF_A_PART:
            self.flush()

    def flush(self) -> None:
        """Make a part of the rows."""
        if self._rows:
            write_part(self._store, self._path.stem, self._rows)
        # Only now, as the part has them all.
        if self._journal is not None:
            self._path.unlink()
        self.close()

    def close(self) -> None:
        """Leave the journal as it is, if there is one."""
        if self._journal is not None:
            os.close(self._journal)
            self._journal = None
        self._rows = []


def write_part(store: Store, name: str, rows: list[Row]) -> None:
    """Add a part, which appears all at once."""
    import pyarrow as pa

    data = parquet_of(pa.Table.from_pylist(rows, store.schema))
    _replace(store.folder / "parts" / f"{name}-{checksum(data)}.parquet", data)


def parquet_of(table: pa.Table) -> bytes:
    """What a Parquet file holds."""
    import pyarrow.parquet as pq

    buffer = io.BytesIO()
    pq.write_table(table, buffer)
    return buffer.getvalue()


def replace_file(path: Path, data: bytes) -> None:
    """Write a file of the folder so that it appears all at once; raises ``WriteError``."""
    with writing(path.parent):
        _replace(path, data)


def _replace(path: Path, data: bytes) -> None:
    """Write a file aside, bring it to the disk, and move it into its place."""
    aside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        with aside.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(aside, path)
    except BaseException:
        aside.unlink(missing_ok=True)
        raise
    _sync_folder(path.parent)


def _sync_folder(folder: Path) -> None:
    """Bring the names in a folder to the disk."""
    if os.name == "nt":  # where folders cannot be opened
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


# -- reading ----------------------------------------------------------------------------------------------------------


def read_part(path: Path) -> tuple[bytes, str]:
    """The contents of a part, and what is wrong with them."""
    try:
        data = read_regular(path)
    except OSError as error:
        return b"", f"cannot be read: {error.strerror}"
    return data, "" if path.stem.endswith(f"-{checksum(data)}") else "is damaged: it is not what was written"


def read_journal(path: Path) -> tuple[list[Row], str]:
    """The rows of a journal, and what is wrong with others; a last line that is not whole was not finished."""
    try:
        lines = read_regular(path).split(b"\n")[:-1]
    except FileNotFoundError:
        raise
    except OSError as error:
        return [], f"cannot be read: {error.strerror}"
    halves = [line.partition(b" ") for line in lines]
    whole = [json.loads(text) for digest, _, text in halves if digest == checksum(text).encode()]
    lost = len(lines) - len(whole)
    return whole, f"is damaged: {counted(lost, 'line')} of {len(lines):,} are not what was written" if lost else ""
