"""Files named by models and users are read only if they are regular files: a pipe may never answer, and a device never
end."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

_KINDS = (
    (stat.S_ISDIR, "a folder, not a file"),
    (stat.S_ISFIFO, "a named pipe, not a regular file"),
    (stat.S_ISSOCK, "a socket, not a regular file"),
)


def irregular(path: str | Path) -> str:
    """What a path is if not a regular file, such as ``a folder, not a file``; empty for a regular file.

    Raises ``OSError``, as for a file that is not there.
    """
    return _kind(os.stat(path).st_mode)


FOLDERS = "EPICYCLE_FOLDERS"  # the variable for folders, or files, of which alone files are read


@contextmanager
def open_regular(path: str | Path) -> Iterator[BinaryIO]:
    """Open a file to read its bytes, without ever waiting for another process.

    Raises ``OSError``; for anything other than a regular file, its ``strerror`` says what it is.
    """
    check_allowed(path)
    _check(os.stat(path), path)
    # The path may be another file by now.
    with open(path, "rb", opener=lambda name, flags: os.open(name, flags | getattr(os, "O_NONBLOCK", 0))) as file:
        _check(os.fstat(file.fileno()), path)
        yield file


def check_allowed(path: str | Path) -> None:
    """Raise ``OSError`` for a file outside of the folders that ``EPICYCLE_FOLDERS`` lists, if it lists any."""
    if listed := os.environ.get(FOLDERS):
        there = Path(path).resolve()
        if not any(there.is_relative_to(folder) for folder in listed.split(os.pathsep)):
            raise OSError(errno.EACCES, "it is outside of the folder that may be read", str(path))


def read_regular(path: str | Path) -> bytes:
    """The contents of a regular file; raises ``OSError`` as ``open_regular`` does."""
    with open_regular(path) as file:
        return file.read()


def read_table(path: Path) -> Any:
    """The Arrow table of a CSV file, or else of a Parquet file; raises ``OSError``."""
    import pyarrow as arrow  # heavy, and needed by few models
    from pyarrow import csv, parquet

    with open_regular(path) as file:
        try:
            table = (csv.read_csv if path.suffix.lower() == ".csv" else parquet.read_table)(file)
            _ = table.column_names  # which may not be UTF-8, as texts in the table
            table.validate(full=True)
            return table
        except (arrow.ArrowException, UnicodeDecodeError) as error:
            raise OSError(errno.EINVAL, " ".join(str(error).split()), str(path)) from None


def _kind(mode: int) -> str:
    if stat.S_ISREG(mode):
        return ""
    return next((kind for is_that, kind in _KINDS if is_that(mode)), "a device, not a regular file")


def _check(found: os.stat_result, path: str | Path) -> None:
    if kind := _kind(found.st_mode):
        raise OSError(errno.EINVAL, f"it is {kind}", str(path))
