"""Who writes to a results folder: one session with all of its runs, or several, each with a share of them."""

from __future__ import annotations

import logging
import os
import platform
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import IO

from epicycle.actors import irregular

from .manifest import StoreError
from .share import ALL, Share
from .store import writing

try:
    import fcntl
except ImportError:  # Windows: nothing keeps two processes from writing to one folder
    fcntl = None  # type: ignore[assignment]

_LOGGER = logging.getLogger("epicycle")
_TRIES, _PAUSE = 25, 0.02  # s


@contextmanager
def lock(folder: Path, share: Share = ALL) -> Iterator[None]:
    """Keep others from writing to a results folder; only other shares may be made there at the same time.

    The lock ends with the process, however it ends.
    """
    with ExitStack() as files:
        with writing(folder):
            folder.mkdir(parents=True, exist_ok=True)
        own = files.enter_context(_opened(folder / "lock"))
        is_ours, who = _is_locked_soon(own, is_shared=share != ALL), f"pid {os.getpid()}"
        if is_ours and share != ALL:
            own = files.enter_context(_opened(folder / f"lock-{share.file_name}"))
            is_ours, who = _is_locked_soon(own), f"part {share}: {who} on {platform.node()}"
        if not is_ours:
            raise StoreError(f"{folder} is in use: another process is writing to it ({', '.join(_writers(folder))})")
        with writing(folder):
            own.truncate(0)
            own.write(f"{who}\n")
            own.flush()
        yield


def is_running(folder: Path) -> bool:
    """Whether somebody writes to a folder."""
    return _is_held(folder / "lock")


def _writers(folder: Path) -> list[str]:
    shares = [path for path in sorted(folder.glob("lock-*")) if _is_held(path)]
    return [path.read_text(encoding="utf-8").strip() for path in shares or [folder / "lock"]]


def _is_held(path: Path) -> bool:
    if not path.is_file():
        return False
    with path.open("a+") as file:
        return not _is_locked(file)


def _opened(path: Path) -> IO[str]:
    with writing(path.parent):
        if path.exists() and (kind := irregular(path)):
            raise StoreError(f"{path} is {kind}: delete it")
        return path.open("a+", encoding="utf-8")


def _is_locked_soon(file: IO[str], *, is_shared: bool = False) -> bool:
    """Lock a file; those who only look whether somebody holds it, as ``is_running`` does, hold it for a moment."""
    for _ in range(_TRIES):
        if _is_locked(file, is_shared=is_shared):
            return True
        time.sleep(_PAUSE)
    return False


def _is_locked(file: IO[str], *, is_shared: bool = False) -> bool:
    """Lock a file unless somebody else holds the lock."""
    try:
        if fcntl is not None:
            fcntl.flock(file, (fcntl.LOCK_SH if is_shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        return False
    except OSError as error:  # some file systems of clusters have no locks
        _LOGGER.warning(
            "warning: %s cannot be locked (%s)\n   help: start nothing twice that writes to this folder",
            file.name,
            error.strerror,
        )
    return True
