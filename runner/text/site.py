"""Where in a Python program a model was built: the line that messages point at, as they do in a YAML file."""

from __future__ import annotations

import linecache
import os
import sys
from collections.abc import Mapping as AnyMapping
from typing import Any

import numpy as np

from epicycle.actors import MAX_DEPTH, is_too_deep

from .document import Entry, Mapping, Node, Scalar, Sequence
from .problems import ModelError, Position, Problem


def call_site() -> Position:
    """The line that called into this package."""
    frame = sys._getframe(1)
    while frame.f_back is not None and str(frame.f_globals.get("__name__")).startswith("epicycle."):
        frame = frame.f_back
    file, line = frame.f_code.co_filename, frame.f_lineno
    source = linecache.getline(file, line, frame.f_globals).rstrip("\n")
    here = os.getcwd() + os.sep
    text = source.strip()
    return Position(file.removeprefix(here), line, len(source) - len(source.lstrip()) + 1, len(text), source)


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
            {str(key): Entry(_key(str(key), position), _node(item, position)) for key, item in value.items()},
            position,
        )
    # Anything else is handed on as it is, such as an object that a parameter of an actor takes.
    return Scalar(value, str(value), False, position)


def entries_of(values: AnyMapping[str, Any], position: Position) -> dict[str, Entry]:
    """Keyword arguments as the entries of a mapping."""
    return {name: Entry(_key(name, position), node_of(value, position)) for name, value in values.items()}


def _key(name: str, position: Position) -> Scalar:
    return Scalar(name, name, False, position)
