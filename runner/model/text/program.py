"""A Python program treated as a text: its lines that call this package or fail, and its values as nodes."""

from __future__ import annotations

import linecache
import os
import re
import sys
from collections.abc import Mapping as AnyMapping
from pathlib import PurePath
from traceback import FrameSummary, extract_tb, walk_tb
from types import FrameType
from typing import Any

import numpy as np

from epicycle.actors import MAX_DEPTH, Configurable, EpicycleError, is_too_deep

from .document import Entry, Mapping, Node, Scalar, Sequence
from .problems import ModelError, Position, Problem

_OURS = re.compile(r"'epicycle\.[\w.]+\.(?=[A-Z]\w*' )")  # as Python calls classes in C


def call_site() -> Position:
    """The line that called into this package."""
    frame = sys._getframe(1)
    while frame.f_back is not None and str(frame.f_globals.get("__name__")).startswith("epicycle."):
        frame = frame.f_back
    file, line = frame.f_code.co_filename, frame.f_lineno
    source = linecache.getline(file, line, frame.f_globals).rstrip("\n")
    text = source.strip()
    return Position(in_short(file), line, len(source) - len(source.lstrip()) + 1, len(text), source)


def raised_at(error: BaseException | None) -> Position | None:
    """The last line of user code that the exception, or else its cause, came through; None if all is library code."""
    seen: set[int] = set()
    while error is not None and id(error) not in seen:
        seen.add(id(error))  # a chain of causes may be circular
        trace = error.__traceback__
        lines = zip(walk_tb(trace), extract_tb(trace), strict=True)
        found = [line for (frame, _), line in lines if _is_users(frame) and line.line]
        if found:
            return _position(found[-1])
        error = error.__cause__
    return None


def _is_users(frame: FrameType) -> bool:
    """Whether code is neither Epicycle's nor a library's; an actor of a package counts as a user's."""
    if str(frame.f_globals.get("__name__")).startswith("epicycle."):
        return False
    import sysconfig  # here, because it takes a while and is needed only for errors

    file = frame.f_code.co_filename
    libraries = (sysconfig.get_path(name) + os.sep for name in ("stdlib", "platstdlib"))
    is_of_library = file.startswith((*libraries, "<frozen ")) or bool(
        {"site-packages", "dist-packages"} & set(PurePath(file).parts)
    )
    return not is_of_library or isinstance(frame.f_locals.get("self"), Configurable)


def _position(line: FrameSummary) -> Position:
    """The place of the expression that failed, or of its whole line if Python does not know it."""
    # With its indentation, which the summary omits.
    source = linecache.getline(line.filename, line.lineno or 0).rstrip("\n") or line.line or ""
    start, end = len(source) - len(source.lstrip()), len(source.rstrip())
    if line.colno is not None:
        # Python counts bytes.
        encoded = source.encode("utf-8", "surrogatepass")
        start = len(encoded[: line.colno].decode("utf-8", "replace"))
        if line.end_lineno == line.lineno and line.end_colno is not None:
            end = len(encoded[: line.end_colno].decode("utf-8", "replace"))
    return Position(in_short(line.filename), line.lineno or 0, start + 1, max(end - start, 1), source)


def in_short(file: str) -> str:
    """A file relative to the current folder, if it is in there."""
    return file.removeprefix(os.getcwd() + os.sep)


def describe(error: BaseException) -> str:
    """An exception in one line; Epicycle's own need no type to be understood."""
    text = str(error).strip()
    if isinstance(error, EpicycleError):
        return text
    text = _OURS.sub("'", text)
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def node_of(value: Any, position: Position) -> Node:
    """A Python value as a model file would hold it; raises ``ModelError`` if it is nested too deeply for one."""
    if is_too_deep(value):
        raise ModelError([Problem(f"nested deeper than {MAX_DEPTH} levels", position)])
    return _node(value, position)


def _node(value: Any, position: Position) -> Node:
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return Sequence(tuple(_node(item, position) for item in value), position)
    if isinstance(value, AnyMapping):
        return Mapping(
            {str(key): Entry(_key(str(key), position), _node(item, position)) for key, item in value.items()}, position
        )
    # Anything else is passed on unchanged, such as an object that a parameter of an actor takes.
    return Scalar(value, str(value), False, position)


def entries_of(values: AnyMapping[str, Any], position: Position) -> dict[str, Entry]:
    """Keyword arguments as the entries of a mapping."""
    return {name: Entry(_key(name, position), node_of(value, position)) for name, value in values.items()}


def _key(name: str, position: Position) -> Scalar:
    return Scalar(name, name, False, position)
