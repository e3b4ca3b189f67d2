"""The results folder of a study: parts that are only ever added, each whole; journals of what is not in one yet.

::

    manifest.json          what the study is, and what its results were made with
    parts/<name>.parquet   rows of runs; a part appears all at once, and is never changed
    journals/<name>.jsonl  one writer's rows since its last part, a line each
    table.parquet          all rows in the order of the plan, made at the end
    lock                   held by the process that writes

A run counts as finished when its line is in a journal, that is before anybody is told: the line is handed to the
operating system at once, where no ``kill`` can reach it, and brought to the disk at most once a second.  The next to
open the folder makes a part of every journal that a writer has left behind.  A row that is in two places is one row.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from epicycle.actors import EpicycleError

from .schedule import FAILED, KILLED, OK, RETRIED, TIMEOUT, Done

if TYPE_CHECKING:
    import pyarrow as pa

try:
    import fcntl
except ImportError:  # Windows: nothing tells two processes that they write to one folder
    fcntl = None  # type: ignore[assignment]

FORMAT = 2
ROWS_OF_A_PART = 1_000
SECONDS_TO_THE_DISK = 1.0
BEST_FIRST = (OK, FAILED, TIMEOUT, KILLED)  # of two rows of one run, the better one counts

Row = dict[str, Any]


class StoreError(EpicycleError):
    """A results folder that cannot be used."""


class WriteError(StoreError):
    """A results folder that takes nothing more."""


def schema_of(manifest: Mapping[str, Any]) -> pa.Schema:
    """The columns of a part."""
    import pyarrow as pa

    kinds = {"bool": pa.bool_(), "int": pa.int64(), "float": pa.float64(), "text": pa.string()}
    fields = [("run", pa.string()), ("condition", pa.string()), ("replication", pa.int64())]
    fields += [(name, kinds[kind]) for name, kind in manifest["factors"].items()]
    fields += [("seed", pa.int64()), ("status", pa.string())]
    fields += [(name, pa.float64()) for name in manifest["metrics"]]
    fields += [("events", pa.int64()), ("digest", pa.string()), ("error", pa.string()), ("wall_time", pa.float64())]
    return pa.schema(fields)


class Store:
    """A results folder that is open for reading; raises ``StoreError`` if it is none, or a broken one."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.manifest = read_manifest(folder)
        self.schema = schema_of(self.manifest)

    def rows(self, columns: list[str] | None = None) -> Iterator[pa.RecordBatch]:
        """All rows, part by part; those of a run that was written twice come twice."""
        import pyarrow as pa

        for path in sorted((self.folder / "parts").glob("*.parquet")):
            yield from self._part(path, columns)
        for path in sorted((self.folder / "journals").glob("*.jsonl")):
            with suppress(FileNotFoundError):  # its writer has just made a part of it
                if rows := read_journal(path):
                    batch = pa.RecordBatch.from_pylist(rows, self.schema)
                    yield batch if columns is None else batch.select(columns)

    def _part(self, path: Path, columns: list[str] | None) -> Iterator[pa.RecordBatch]:
        import pyarrow as pa
        import pyarrow.parquet as pq

        try:
            with pq.ParquetFile(path) as file:
                if not file.schema_arrow.equals(self.schema):
                    raise StoreError(
                        f"{path} has not the columns of {self.folder}/manifest.json: it is of another study"
                    )
                yield from file.iter_batches(columns=columns)
        except (pa.ArrowException, OSError) as error:
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise StoreError(
                f"{path} is broken: {reason}\n"
                f"   help: delete it, and 'epicycle resume {self.folder}' makes its runs anew"
            ) from error

    def known(self, value: str | None = None) -> dict[str, Done]:
        """The runs that are there, by key; ``value`` names the metric that is wanted of each."""
        found: dict[str, Done] = {}
        columns = ["run", "status", *([value] if value else [])]
        for batch in self.rows(columns):
            values = batch.column(2).to_pylist() if value else [None] * batch.num_rows
            for key, status, number in zip(
                batch.column(0).to_pylist(), batch.column(1).to_pylist(), values, strict=True
            ):
                if (before := found.get(key)) is None or rank(status) < rank(before.status):
                    found[key] = Done(status, number)
        return found


def rank(status: str) -> int:
    """The smaller, the better."""
    return BEST_FIRST.index(status)


# -- the manifest -----------------------------------------------------------------------------------------------------


# What a plan is made of again.
_NEEDED = (
    "epicycle", "study", "file", "text", "set", "types", "replications", "factors", "metrics", "columns", "model",
    "sources", "level_sources",
)  # fmt: skip


def read_manifest(folder: Path) -> dict[str, Any]:
    """What a results folder says of itself; raises ``StoreError``."""
    path = folder / "manifest.json"
    if not folder.is_dir():
        raise StoreError(f"there is no folder {folder}")
    if not path.is_file():
        raise StoreError(f"{folder} holds no results of a study: it has no manifest.json")
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise StoreError(f"{path} is broken: {error}") from error
    if not isinstance(manifest, dict) or "level_sources" not in manifest:
        raise StoreError(f"{folder} holds other results, not those of a study")
    if (found := manifest.get("format")) != FORMAT:
        raise StoreError(f"{folder} has format {found}, this Epicycle reads format {FORMAT}")
    if missing := [key for key in _NEEDED if key not in manifest]:
        raise StoreError(f"{path} is broken: it has no {', '.join(map(repr, missing))}")
    return manifest


def prepare(folder: Path, manifest: Mapping[str, Any]) -> Store:
    """Make a results folder, or see that one that is there holds results of the same study; journals become parts.

    Raises ``StoreError``.  The caller holds the lock.
    """
    path = folder / "manifest.json"
    if path.is_file():
        before = read_manifest(folder)
        if before["study"] != manifest["study"]:
            raise StoreError(
                f"{folder} holds results of the study {before['study']!r}, not of {manifest['study']!r}\n"
                "   help: choose another folder with --out"
            )
        for what in ("factors", "metrics"):
            if list(before[what].items()) != list(manifest[what].items()):
                raise StoreError(
                    f"{folder} was made when {manifest['study']} had other {what}: {_shown(before[what])}, "
                    f"not {_shown(manifest[what])}\n   help: choose another folder with --out"
                )
    elif folder.is_dir() and any(
        each.name not in ("lock", "parts", "journals") and not each.name.startswith(".manifest.json")
        for each in folder.iterdir()
    ):
        raise StoreError(
            f"{folder} is not empty, and holds no results of a study\n   help: choose another folder with --out"
        )
    with writing(folder):
        for name in ("parts", "journals"):
            (folder / name).mkdir(exist_ok=True)
        _replace(path, lambda aside: aside.write_text(json.dumps(manifest, indent=1) + "\n", encoding="utf-8"))
        store = Store(folder)
        for pattern in ("parts/.*.parquet.*", ".manifest.json.*", ".table.parquet.*"):
            for aside in folder.glob(pattern):
                aside.unlink()  # what somebody was writing when killed
    collect(store)
    return store


def collect(store: Store) -> None:
    """Make parts of the journals that writers have left behind."""
    with writing(store.folder):
        for journal in sorted((store.folder / "journals").glob("*.jsonl")):
            _recover(journal, store)


def _shown(columns: Mapping[str, str]) -> str:
    return ", ".join(name if name == what else f"{name} ({what})" for name, what in columns.items()) or "none"


@contextmanager
def lock(folder: Path) -> Iterator[None]:
    """Keep others from writing to a results folder; the lock ends with the process, however it ends."""
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        file = (folder / "lock").open("a+")
    with file:
        if fcntl is not None:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                file.seek(0)
                raise StoreError(f"{folder} is being written by another process ({file.read().strip()})") from None
        file.truncate(0)
        file.write(f"pid {os.getpid()}\n")
        file.flush()
        yield


def is_running(folder: Path) -> bool:
    """Whether somebody holds the lock."""
    if not (folder / "lock").is_file():
        return False
    with (folder / "lock").open("a+") as file:
        try:
            if fcntl is not None:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            return True
    return False


@contextmanager
def writing(folder: Path) -> Iterator[None]:
    """Tell of a full disk, missing rights and the like in one sentence: raise ``WriteError``."""
    try:
        yield
    except OSError as error:
        raise WriteError(cannot_write(folder, error.strerror or str(error))) from error


def cannot_write(folder: Path, reason: str) -> str:
    """The message of a folder that takes nothing more."""
    message = f"cannot write to {folder}: {reason}"
    if not (folder / "manifest.json").is_file():  # nothing has begun
        return message
    return f"{message}\n   help: what was finished is kept; 'epicycle resume {folder}' goes on"


# -- writing rows -----------------------------------------------------------------------------------------------------


class Writer:
    """One writer of rows; raises ``OSError`` if it cannot write, and then nothing half is left."""

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
            if fcntl is not None:
                fcntl.flock(self._journal, fcntl.LOCK_EX)
            _sync_folder(self._path.parent)
        line = (json.dumps(row) + "\n").encode()
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
        if self._journal is None:
            return
        if self._rows:
            write_part(self._store, self._path.stem, self._rows)
        # Only now, as the part has them all.
        self._path.unlink()
        os.close(self._journal)
        self._journal = None
        self._rows = []


def write_part(store: Store, name: str, rows: list[Row]) -> None:
    """Add a part, which appears all at once."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pa.Table.from_pylist(rows, store.schema)
    _replace(store.folder / "parts" / f"{name}.parquet", lambda aside: pq.write_table(table, aside))


def read_journal(path: Path) -> list[Row]:
    """The rows of a journal; a last line that is not whole was not finished."""
    lines = path.read_bytes().split(b"\n")[:-1]
    found = []
    for line in lines:
        with suppress(ValueError):  # the machine went down before the line came to the disk
            found.append(json.loads(line))
    return found


def _recover(journal: Path, store: Store) -> None:
    """Make a part of a journal whose writer is gone."""
    with journal.open("rb") as file:
        if fcntl is not None:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                return  # a worker that outlived its study is just ending: rows are read from the journal as it is
        if rows := read_journal(journal):
            write_part(store, journal.stem, rows)
        journal.unlink()


def _replace(path: Path, write: Callable[[Path], object]) -> None:
    """Write a file aside, bring it to the disk, and move it into its place."""
    aside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        write(aside)
        with aside.open("rb+") as file:
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


def replace_file(path: Path, write: Callable[[Path], object]) -> None:
    """Write a file of the folder so that it appears all at once; raises ``StoreError``."""
    with writing(path.parent):
        _replace(path, write)


def is_wanted(done: Done, retry: bool) -> bool:
    """Whether a run that is there counts, or is to be made again."""
    return not (retry and done.status in RETRIED)
