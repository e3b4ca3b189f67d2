"""What an exception says and where it comes from: the last line of a user's own code that it went through."""

from __future__ import annotations

import os
import sysconfig
from pathlib import PurePath
from traceback import FrameSummary, extract_tb, walk_tb
from types import FrameType

from epicycle.actors import Configurable, EpicycleError

from .problems import Position

_LIBRARIES = tuple(sysconfig.get_path(name) + os.sep for name in ("stdlib", "platstdlib"))


def raised_at(error: BaseException | None) -> Position | None:
    """The last line of a user's that the exception came through, or else its cause; None if all is library code."""
    seen: set[int] = set()
    while error is not None and id(error) not in seen:
        seen.add(id(error))  # a chain of causes may be a ring
        trace = error.__traceback__
        lines = zip(walk_tb(trace), extract_tb(trace), strict=True)
        found = [line for (frame, _), line in lines if _is_users(frame) and line.line]
        if found:
            return _position(found[-1])
        error = error.__cause__
    return None


def _is_users(frame: FrameType) -> bool:
    """Whether code is neither ours nor a library's; a package's actor is as good as a user's."""
    if str(frame.f_globals.get("__name__")).startswith("epicycle."):
        return False
    file = frame.f_code.co_filename
    is_of_library = file.startswith((*_LIBRARIES, "<frozen ")) or bool(
        {"site-packages", "dist-packages"} & set(PurePath(file).parts)
    )
    return not is_of_library or isinstance(frame.f_locals.get("self"), Configurable)


def _position(line: FrameSummary) -> Position:
    """The place of the expression that failed, or of its whole line where Python does not tell."""
    source = _source(line)
    start, end = len(source) - len(source.lstrip()), len(source.rstrip())
    if line.colno is not None:
        # Python counts bytes.
        encoded = source.encode("utf-8", "surrogatepass")
        start = len(encoded[: line.colno].decode("utf-8", "replace"))
        if line.end_lineno == line.lineno and line.end_colno is not None:
            end = len(encoded[: line.end_colno].decode("utf-8", "replace"))
    return Position(in_short(line.filename), line.lineno or 0, start + 1, max(end - start, 1), source)


def _source(line: FrameSummary) -> str:
    """The line with its indentation, which the summary has left out."""
    import linecache

    return linecache.getline(line.filename, line.lineno or 0).rstrip("\n") or line.line or ""


def in_short(file: str) -> str:
    """A file as seen from the present folder, if it is in there."""
    return file.removeprefix(os.getcwd() + os.sep)


def describe(error: BaseException) -> str:
    """An exception in one line; our own explain themselves without their type."""
    text = str(error).strip()
    if isinstance(error, EpicycleError):
        return text
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
