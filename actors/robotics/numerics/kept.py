"""Where compiled kernels are kept."""

from __future__ import annotations

import hashlib
import os
from contextlib import suppress
from pathlib import Path

from ...core import elementary


def folder() -> Path:
    """Where compiled code is kept; named after all sources of this package and of the elementary functions.

    By itself, numba checks only the file of a kernel, and would keep using old code that it calls from others.
    """
    if own := os.environ.get("NUMBA_CACHE_DIR"):
        above = Path(own)
    elif os.access(_HERE, os.W_OK):
        above = _HERE / "__pycache__"
    else:
        above = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "epicycle"
    return above / _SOURCES


def mark(name: str) -> None:
    """Leave a note for later processes, if files can be made."""
    with suppress(OSError):
        folder().mkdir(parents=True, exist_ok=True)
        (folder() / name).touch()


_HERE = Path(__file__).parent
_FILES = [path for folder in (_HERE, Path(elementary.__file__).parent) for path in sorted(folder.glob("*.py"))]
_SOURCES = hashlib.sha256(b"".join(path.read_bytes() for path in _FILES)).hexdigest()[:16]
