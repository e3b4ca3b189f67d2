"""The contents of a token of any kind, for aspects that alter or read them."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from epicycle.actors import EpicycleError

# The field with the time that a token describes.  No sensor measures it, so aspects that alter all numbers do not
# change it, nor the stamp in the header of a message.
STAMP = "time"
_STAMPS = (STAMP, "stamp")

Change = Callable[[NDArray[np.float64]], NDArray[np.float64]]


class FieldError(EpicycleError):
    """A token lacks the field, or the numbers, that an aspect needs."""


def altered(token: Any, fields: tuple[str, ...], change: Change) -> Any:
    """The token with ``change`` applied to its numbers: all except times, or those of the named fields.

    A token may be a number, an array, a list or tuple of these, a dataclass or a dict.  Texts and truth values stay as
    they are, and an integer stays an integer (rounded to even).  A field of a field is named with a dot:
    ``pose.position``.  Raises ``FieldError``.
    """
    if not fields:
        return _changed(token, change)
    inner = _grouped(fields)
    for name in inner:
        field_of(token, name, "leave out 'fields' to alter all its numbers")
    if isinstance(token, dict):
        return {name: altered(value, inner[name], change) if name in inner else value for name, value in token.items()}
    return dataclasses.replace(token, **{name: altered(getattr(token, name), inner[name], change) for name in inner})


@lru_cache
def _grouped(fields: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    """The fields of fields, by the names of these; () is a whole one."""
    found: dict[str, tuple[str, ...]] = {}
    for name, _, rest in (each.partition(".") for each in fields):
        whole = not rest or found.get(name) == ()
        found[name] = () if whole else (*found.get(name, ()), rest)
    return found


def stamped_as(token: Any, other: Any) -> Any:
    """A token with the time of another one, if both have one."""
    if isinstance(token, dict) and isinstance(other, dict):
        return {**token, STAMP: other[STAMP]} if STAMP in token and STAMP in other else token
    if _has_stamp(token) and _has_stamp(other):
        return dataclasses.replace(token, **{STAMP: getattr(other, STAMP)})
    return token


def _has_stamp(token: Any) -> bool:
    is_record = dataclasses.is_dataclass(token) and not isinstance(token, type)
    return is_record and any(each.name == STAMP for each in dataclasses.fields(token))


def field_of(token: Any, name: str, advice: str = "") -> Any:
    """A field of a token that is a dataclass or a dict; raises ``FieldError``, with advice where it has no fields."""
    if isinstance(token, dict):
        names = list(token)
    elif dataclasses.is_dataclass(token) and not isinstance(token, type):
        names = [each.name for each in dataclasses.fields(token)]
    else:
        raise FieldError(f"a token of type {type(token).__name__} has no fields{advice and f'; {advice}'}")
    if name not in names:
        known = ", ".join(each for each in map(str, names) if each.isprintable())  # others are not for people
        raise FieldError(f"{type(token).__name__} has no field {name!r}; its fields: {known}")
    return token[name] if isinstance(token, dict) else getattr(token, name)


def numbers_in(token: Any) -> int:
    """The number of numbers in a token, at any depth, without texts and truth values.  Raises ``FieldError``."""
    if isinstance(token, (bool, np.bool_, str)) or token is None:
        return 0
    if isinstance(token, (int, float, np.number)):
        return 1
    if isinstance(token, np.ndarray) and token.dtype.kind in "biufc":
        return token.size
    if isinstance(token, (list, tuple)):
        return sum(map(numbers_in, token))
    if isinstance(token, dict):
        return sum(map(numbers_in, token.values()))
    if dataclasses.is_dataclass(token) and not isinstance(token, type):
        return sum(numbers_in(getattr(token, each.name)) for each in dataclasses.fields(token))
    raise FieldError(f"a token of type {type(token).__name__} holds no numbers to count")


def _changed(value: Any, change: Change) -> Any:
    if isinstance(value, (bool, np.bool_, str)) or value is None:
        return value
    if isinstance(value, (int, np.integer)):
        number = float(change(np.array([float(value)]))[0])
        return round(number) if np.isfinite(number) else number
    if isinstance(value, (float, np.floating)):
        return float(change(np.array([float(value)]))[0])
    if isinstance(value, np.ndarray) and value.dtype.kind in "iuf":
        array = change(value.astype(np.float64).ravel()).reshape(value.shape)
        if value.dtype.kind != "f":
            array = np.rint(array)
        array.flags.writeable = False
        return array
    if isinstance(value, (list, tuple)):
        return type(value)([_changed(item, change) for item in value])
    if isinstance(value, dict):
        return {key: item if key in _STAMPS else _changed(item, change) for key, item in value.items()}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        names = [each.name for each in dataclasses.fields(value) if each.name != STAMP]
        return dataclasses.replace(value, **{name: _changed(getattr(value, name), change) for name in names})
    raise FieldError(f"a token of type {type(value).__name__} holds no numbers to alter")
