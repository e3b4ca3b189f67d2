"""Writes files that show a run, completely or not at all."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from epicycle.actors import EpicycleError


class ViewError(EpicycleError):
    """A page or another file that shows a run cannot be made."""


def replace_file(path: Path, data: bytes) -> None:
    """Write a file; an existing one is replaced only once the new one is complete.  Raises ``ViewError``."""
    aside = path.with_name(f".{path.name}")
    try:
        aside.write_bytes(data)
        os.replace(aside, path)
    except OSError as error:
        with suppress(OSError):
            aside.unlink()
        raise ViewError(f"{path} cannot be written: {error.strerror or error}") from error
