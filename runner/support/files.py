"""Writes files completely or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from secrets import token_hex
from typing import BinaryIO

from epicycle.actors import EpicycleError


@contextmanager
def replacing(path: Path, error: type[EpicycleError] | None = None) -> Iterator[BinaryIO]:
    """A new file, which replaces the one at a path once it is complete and on the disk.

    Raises ``OSError``, or an ``error`` in its place.
    """
    aside = path.with_name(f".{path.name}.{token_hex(8)}")  # other machines may write to the folder, too
    try:
        with aside.open("wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        os.replace(aside, path)
    except BaseException as raised:
        with suppress(OSError):
            aside.unlink()
        if error is None or not isinstance(raised, OSError):
            raise
        raise error(f"{path} cannot be written: {raised.strerror or raised}") from raised


def replace_file(path: Path, data: bytes | str, error: type[EpicycleError] | None = None) -> None:
    """Write a file; an existing one is replaced only once the new one is complete.  Raises as ``replacing``."""
    with replacing(path, error) as file:
        file.write(data.encode() if isinstance(data, str) else data)
