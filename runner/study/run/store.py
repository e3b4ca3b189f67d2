"""The results folder of a study: parts, which are only added, each complete; journals of rows not yet in a part.

::

    manifest.json          what the study is, and what its results were made with
    parts/<name>-<checksum>.parquet
                           rows of runs; a part appears all at once, and is never changed
    journals/<name>.jsonl  the rows of a session since its last part, a line each: checksum, row
    table.parquet          all rows in the order of the plan, written at the end
    lock, lock-<share>     held by those who write: one process, or one for each share of the runs
    damaged/               files that did not match their checksums

A run counts as finished once its line is in a journal, before anybody is notified: the line is handed to the operating
system at once, where no ``kill`` can reach it, and brought to the disk at most once a second.  The next session to open
the folder turns every journal left behind into a part.  A row in two places counts once.

Processes on several machines may write at the same time if each makes a share of the runs: each writes journals and
parts of its own, and reads only what no longer changes.  The table is written by a session without a share.

The manifest contains its checksum, a part has it in its name, a row of a journal before it, and nothing is used before
its checksum is verified.  Readers get an error about damage; a session that continues the study sets the damaged file
aside, and repeats the lost runs.
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
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from epicycle.actors import counted, irregular, read_regular

from ...support.files import replace_file
from .backlog import FAILED, KILLED, OK, TIMEOUT, Done
from .manifest import OF_SESSION, DamagedError, StoreError, checksum, manifest_text, read_manifest, schema_of
from .share import ALL, Share

if TYPE_CHECKING:
    import pyarrow as pa

_LOGGER = logging.getLogger("epicycle")

ROWS_OF_A_PART = 1_000
SECONDS_TO_THE_DISK = 1.0
_OURS = ("lock", "parts", "journals", "damaged", "manifest.json")  # how names in a folder begin that is just being made
_ANOTHER = "\n   help: choose another folder with --out"
BEST_FIRST = (OK, FAILED, TIMEOUT, KILLED)  # of two rows of a run, the better one counts

Row = dict[str, Any]


class WriteError(StoreError):
    """A results folder that cannot be written to."""


class Store:
    """A results folder open for reading; raises ``StoreError`` if it is not one, or is broken."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.manifest = read_manifest(folder)
        self.schema = schema_of(self.manifest)

    def rows(self, columns: list[str] | None = None, *, journals: bool = True) -> Iterator[pa.RecordBatch]:
        """All rows, part by part; a run that was written twice comes twice."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        for path in sorted(self.folder.glob("parts/*.parquet")):
            data, damage = read_part(path)
            self._check(path, damage)
            with pq.ParquetFile(pa.BufferReader(data)) as file:
                if not file.schema_arrow.equals(self.schema):
                    told = f"{path} lacks the columns of {self.folder}/manifest.json: it belongs to another study"
                    raise StoreError(told)
                yield from file.iter_batches(columns=columns)
        for path in sorted(self.folder.glob("journals/*.jsonl") if journals else ()):
            with suppress(FileNotFoundError):  # its writer has just turned it into a part
                rows, damage = read_journal(path, self.schema)
                self._check(path, damage)
                if rows:
                    yield pa.RecordBatch.from_pylist(rows, self.schema).select(columns or self.schema.names)

    def known(self, value: str | None = None, *, journals: bool = True) -> dict[str, Done]:
        """The existing runs by key; ``value`` names the metric to return of each."""
        found: dict[str, Done] = {}
        for batch in self.rows(["run", "status", *([value] if value else [])], journals=journals):
            for key, status, *number in zip(*(column.to_pylist() for column in batch.columns), strict=True):
                if _is_better(status, found.get(key)):
                    found[key] = Done(status, *number)
        return found

    def _check(self, path: Path, damage: str) -> None:
        if damage:
            told = f"'epicycle study {self.folder}' sets it aside and repeats its lost runs"
            raise DamagedError(f"{path} {damage}\n   help: {told}")


# -- opening it for writing -------------------------------------------------------------------------------------------


def prepare(folder: Path, manifest: Mapping[str, Any], share: Share = ALL) -> Store:
    """Make a results folder, or check that an existing one holds results of the same study; journals become parts.

    Raises ``StoreError``.  The caller holds the lock, so whoever left a journal behind no longer runs; beside other
    shares, only what belongs to this one is touched.
    """
    path = folder / "manifest.json"
    before: Mapping[str, Any] | None = None
    if path.exists():
        try:
            before = read_manifest(folder)
        except DamagedError:
            if not (folder / "parts").is_dir():  # it may never have been one of ours
                raise
            _LOGGER.warning("%s is damaged and is being rewritten", path)
    elif folder.is_dir() and any(not each.name.lstrip(".").startswith(_OURS) for each in folder.iterdir()):
        raise StoreError(f"{folder} is not empty, and holds no results of a study{_ANOTHER}")
    if before is not None:
        _check_same(folder, before, manifest)
    with writing(folder):
        for name in ("parts", "journals"):
            (folder / name).mkdir(exist_ok=True)
        if share == ALL or before is None or _plan_in(before) != _plan_in(manifest):
            _replace(path, manifest_text(manifest))
        for pattern in ("parts/.*.parquet.*", ".manifest.json.*", ".table.parquet.*") if share == ALL else ():
            for aside in folder.glob(pattern):
                aside.unlink()  # left by a process that was killed while writing
        store = Store(folder)
        for part in sorted(folder.glob("parts/*.parquet")):
            if damage := read_part(part)[1]:
                _put_aside(part, f"{damage}; its runs are repeated")
        for journal in sorted(folder.glob(f"journals/{'*' if share == ALL else f'{share.file_name}-*'}.jsonl")):
            if kind := irregular(journal):
                _put_aside(journal, f"is {kind}")
                continue
            rows, damage = read_journal(journal, store.schema)
            if rows:
                write_part(store, journal.stem, rows)
            if damage:
                _put_aside(journal, f"{damage}; their runs are repeated")
            else:
                journal.unlink()
    return store


def take(store: Store, folder: Path) -> None:
    """Add the rows of another results folder of the same study; raises ``StoreError`` for one of another study."""
    other, known = Store(folder), store.known()
    _check_same(folder, other.manifest, store.manifest)
    for batch in other.rows():
        rows = [row for row in batch.to_pylist() if _is_better(row["status"], known.get(row["run"]))]
        if rows:
            with writing(store.folder):
                write_part(store, uuid4().hex, rows)


def _is_better(status: str, before: Done | None) -> bool:
    return before is None or BEST_FIRST.index(status) < BEST_FIRST.index(before.status)


def _check_same(folder: Path, before: Mapping[str, Any], manifest: Mapping[str, Any]) -> None:
    """Raise ``StoreError`` if a folder holds results of a study unlike that of a manifest."""
    name = manifest["study"]
    if before["study"] != name:
        raise StoreError(f"{folder} holds results of the study {before['study']!r}, not of {name!r}{_ANOTHER}")
    for what in ("factors", "metrics"):
        if list(before[what].items()) != list(manifest[what].items()):
            had, has = _shown(before[what]), _shown(manifest[what])
            raise StoreError(f"{folder} was made when {name} had different {what}: {had}, not {has}{_ANOTHER}")


def _plan_in(manifest: Mapping[str, Any]) -> str:
    """The entries of a manifest that say what the study is, not when and where it is made."""
    return json.dumps({name: value for name, value in manifest.items() if name not in OF_SESSION}, sort_keys=True)


def _shown(columns: Mapping[str, str]) -> str:
    return ", ".join(name if name == what else f"{name} ({what})" for name, what in columns.items()) or "none"


def _put_aside(path: Path, damage: str) -> None:
    """Move a damaged file to where it does no harm, and report it."""
    aside = path.parent.parent / "damaged"
    aside.mkdir(exist_ok=True)
    with suppress(FileNotFoundError):  # another session has just done it
        os.replace(path, aside / path.name)
    _LOGGER.warning("%s %s\n   the damaged file is kept in %s", path, damage, aside)


# -- writing ----------------------------------------------------------------------------------------------------------


@contextmanager
def writing(folder: Path) -> Iterator[None]:
    """Report a full disk, missing permissions and similar in one sentence: raise ``WriteError``."""
    try:
        yield
    except OSError as error:
        message = f"cannot write to {folder}: {error.strerror or error}"
        if (folder / "manifest.json").is_file():  # there is something to resume
            message += f"\n   help: finished runs are kept; 'epicycle study {folder}' continues"
        raise WriteError(message) from error


class Writer:
    """Writes rows; raises ``OSError`` if it cannot, and then leaves nothing incomplete."""

    def __init__(self, store: Store, share: Share = ALL) -> None:
        self._store = store
        self._name = share.file_name
        self._rows: list[Row] = []
        self._journal: int | None = None
        self._path = store.folder
        self._synced = 0.0

    def add(self, row: Row) -> None:
        """Write a row; when this returns, the row outlives the process."""
        if self._journal is None:
            self._path = self._store.folder / "journals" / f"{self._name}-{uuid4().hex}.jsonl".lstrip("-")
            self._journal = os.open(self._path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
            _sync_folder(self._path.parent)
        text = json.dumps(row).encode()
        line = b"%s %s\n" % (checksum(text).encode(), text)
        size = os.fstat(self._journal).st_size
        try:
            if os.write(self._journal, line) < len(line):  # the disk is full: the next attempt reports it
                os.write(self._journal, line)
                raise OSError("a row could be written only in part")
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
        """Turn the rows into a part."""
        if self._rows:
            write_part(self._store, self._path.stem, self._rows)
        # Only now that the part has them all.
        if self._journal is not None:
            self._path.unlink()
        self.close()

    def close(self) -> None:
        """Leave the journal as it is, if any."""
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
    """The bytes of a Parquet file."""
    import pyarrow.parquet as pq

    buffer = io.BytesIO()
    pq.write_table(table, buffer)
    return buffer.getvalue()


def write(path: Path, data: bytes | str) -> None:
    """Write a file of the folder so that it appears all at once; raises ``WriteError``."""
    with writing(path.parent):
        _replace(path, data)


def _replace(path: Path, data: bytes | str) -> None:
    replace_file(path, data)
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
    """The contents of a part, and what is wrong with it."""
    try:
        data = read_regular(path)
    except OSError as error:
        return b"", f"cannot be read: {error.strerror}"
    if not path.stem.endswith(f"-{checksum(data)}"):
        return data, "is damaged: it does not match its checksum"
    return data, f"is damaged: {wrong}" if (wrong := _wrong_part(data)) else ""


def _wrong_part(data: bytes) -> str:
    """Why a part whose checksum is right, as anybody can compute it, is not one that we have written."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        with pq.ParquetFile(pa.BufferReader(data)) as file:
            return next(filter(None, map(_wrong_batch, file.iter_batches())), "")
    except (pa.ArrowException, OSError, ValueError) as error:
        return str(error)


def _wrong_batch(batch: pa.RecordBatch) -> str:
    """Why rows cannot be those of a study; raises pyarrow's errors for values that are none."""
    batch.validate(full=True)
    said = dict(zip(batch.schema.names, batch.columns, strict=True))
    if "run" not in said or "status" not in said:
        return ""  # of another study, which ``rows`` reports
    is_known = {*said["status"].unique().to_pylist()} <= {*BEST_FIRST}
    return "" if is_known and not said["run"].null_count else "it has a row without a run or a known status"


def _are_rows(rows: list[Any], schema: pa.Schema) -> bool:
    """Whether lines of a journal are rows of a study with these columns."""
    import pyarrow as pa

    try:
        is_plain = all(isinstance(row, dict) for row in rows)
        return is_plain and not _wrong_batch(pa.RecordBatch.from_pylist(rows, schema))
    except (pa.ArrowException, ValueError, TypeError, OverflowError):
        return False


def read_journal(path: Path, schema: pa.Schema) -> tuple[list[Row], str]:
    """The intact rows of a journal, and what is wrong with others; an incomplete last line was never finished."""
    try:
        lines = read_regular(path).split(b"\n")[:-1]
    except FileNotFoundError:
        raise
    except OSError as error:
        return [], f"cannot be read: {error.strerror}"
    halves = [line.partition(b" ") for line in lines]
    texts = [text for digest, _, text in halves if digest == checksum(text).encode()]
    whole = list(map(_parsed, texts))
    if not _are_rows(whole, schema):
        whole = [row for row in whole if _are_rows([row], schema)]
    lost, wrong = len(lines) - len(whole), "with a wrong checksum" if len(whole) == len(texts) else "cannot be read"
    return whole, f"is damaged: {counted(lost, 'line')} of {len(lines):,} {wrong}" if lost else ""


def _parsed(text: bytes) -> Any:
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return None
