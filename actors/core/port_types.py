"""Types of ports: their names, and which tokens may go where."""

from __future__ import annotations

import types
import typing
from collections.abc import Iterable
from functools import reduce
from operator import or_
from typing import Any

import numpy as np


def shaped(type: Any, shape: tuple[int | None, ...]) -> Any:
    """The type of arrays of one shape; ``None`` is any length.  In a union: ``float | shaped(np.ndarray, (2,))``."""
    return typing.Annotated.__class_getitem__((type, shape))  # type: ignore[attr-defined]


def _shape(declared: Any) -> tuple[int | None, ...] | None:
    """The shape that a type declares, if any."""
    if typing.get_origin(declared) is not typing.Annotated:
        return None
    said = declared.__metadata__[0]
    return said if isinstance(said, tuple) else None


def type_name(declared: Any) -> str:
    """A port type as a person would write it."""
    if declared is object or declared is Any:
        return "any"
    if declared is np.ndarray:
        return "array"
    if (shape := _shape(declared)) is not None:
        return f"{type_name(declared.__origin__)}[{', '.join('n' if size is None else str(size) for size in shape)}]"
    arguments = typing.get_args(declared)
    if isinstance(declared, types.UnionType) or typing.get_origin(declared) is typing.Union:
        return " | ".join(type_name(argument) for argument in arguments)
    if arguments:
        return f"{type_name(typing.get_origin(declared))}[{', '.join(type_name(a) for a in arguments)}]"
    return getattr(declared, "__name__", str(declared))


def accepts(wanted: Any, given: Any) -> bool:
    """Whether every token of type ``given`` may enter a port of type ``wanted``; an int passes for a float.

    ``Any`` is for actors that pass on what they get: it fits everything.  An array of any length does not fit where a
    fixed length is required; an array without a declared shape fits every shape.
    """
    if wanted in (object, Any) or given is Any or wanted == given:
        return True
    if isinstance(given, types.UnionType) or typing.get_origin(given) is typing.Union:
        return all(accepts(wanted, each) for each in typing.get_args(given))
    if isinstance(wanted, types.UnionType) or typing.get_origin(wanted) is typing.Union:
        return any(accepts(each, given) for each in typing.get_args(wanted))
    shapes = _shape(wanted), _shape(given)
    if shapes != (None, None):
        kinds = [
            each if shape is None else each.__origin__ for each, shape in zip((wanted, given), shapes, strict=True)
        ]
        return _fits(*shapes) and accepts(*kinds)
    if wanted is float and given is int:
        return True
    inner, outer = typing.get_origin(given) or given, typing.get_origin(wanted) or wanted
    if isinstance(inner, type) and isinstance(outer, type) and issubclass(inner, outer):
        wanted_arguments, given_arguments = typing.get_args(wanted), typing.get_args(given)
        return not wanted_arguments or wanted_arguments == given_arguments
    return False


def _fits(wanted: tuple[int | None, ...] | None, given: tuple[int | None, ...] | None) -> bool:
    if wanted is None or given is None:
        return True
    return len(wanted) == len(given) and all(w in (None, g) for w, g in zip(wanted, given, strict=True))


def token_type(values: Iterable[object]) -> Any:
    """The port type of given values: ``bool``, ``int``, ``float`` (ints become floats beside floats), ``str``, or a
    union of these; any type if there are others."""
    found = dict.fromkeys(type(value) for value in values)
    if not found or found.keys() - {bool, int, float, str}:
        return Any
    return reduce(or_, (each for each in found if each is not int or float not in found))
