"""Tokens as plain data and as canonical bytes, for the event log and its digest.

A token may be a number, a text, None, a list or tuple, a mapping with text keys, a NumPy array, or a dataclass of
these.  Anything else is logged by its ``repr``, which must then not contain an address.
"""

from __future__ import annotations

import dataclasses
import struct
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np

_DOUBLE = struct.Struct("<d").pack
_INTEGER = struct.Struct("<q").pack
_COUNT = struct.Struct("<I").pack


@cache
def field_names(cls: type) -> tuple[str, ...]:
    """The fields of a dataclass, in order."""
    return tuple(each.name for each in dataclasses.fields(cls))


def plain(token: Any) -> Any:
    """A token as JSON-like data: numbers, texts, lists and dicts."""
    if token is None or isinstance(token, (bool, int, float, str)):
        return token
    if isinstance(token, np.ndarray):
        return token.tolist()
    if isinstance(token, np.generic):
        return token.item()
    if isinstance(token, (list, tuple)):
        return [plain(item) for item in token]
    if isinstance(token, dict):
        return {str(key): plain(item) for key, item in token.items()}
    if dataclasses.is_dataclass(token) and not isinstance(token, type):
        return {name: plain(getattr(token, name)) for name in field_names(type(token))}
    return repr(token)


def canonical(token: Any) -> bytes:
    """A token as bytes: equal tokens give equal bytes on every machine, and no two kinds are confused."""
    if isinstance(token, float):
        return b"f" + _DOUBLE(token)
    if isinstance(token, np.ndarray):
        array = np.ascontiguousarray(token)
        shape = b"".join(_COUNT(size) for size in array.shape)
        return b"a" + array.dtype.str.encode() + _COUNT(array.ndim) + shape + array.tobytes()
    if dataclasses.is_dataclass(token) and not isinstance(token, type):
        names = field_names(type(token))
        return b"d" + b"".join(_named(name, getattr(token, name)) for name in names) + b";"
    if token is None:
        return b"n"
    if isinstance(token, bool):
        return b"t" if token else b"u"
    if isinstance(token, int):
        if -(2**63) <= token < 2**63:
            return b"i" + _INTEGER(token)
        return b"I" + _text(str(token))
    if isinstance(token, str):
        return b"s" + _text(token)
    if isinstance(token, np.generic):
        return canonical(token.item())
    if isinstance(token, (list, tuple)):
        return b"l" + _COUNT(len(token)) + b"".join(canonical(item) for item in token)
    if isinstance(token, dict):
        return b"m" + _COUNT(len(token)) + b"".join(_named(str(key), item) for key, item in token.items())
    return b"r" + _text(repr(token))


def _text(text: str) -> bytes:
    data = text.encode("utf-8", "surrogatepass")
    return _COUNT(len(data)) + data


def _named(name: str, value: Any) -> bytes:
    return _text(name) + canonical(value)


def scalars(token: Any, field: str = "") -> Iterator[tuple[str, float]]:
    """The numbers inside a token with the names of their places, e.g. ``("position[0]", 1.5)``."""
    if isinstance(token, (bool, int, float, np.generic)):
        yield field, float(token)
    elif isinstance(token, (np.ndarray, list, tuple)):
        for index, item in enumerate(token):
            yield from scalars(item, f"{field}[{index}]")
    elif isinstance(token, dict):
        for key, item in token.items():
            yield from scalars(item, f"{field}.{key}" if field else str(key))
    elif dataclasses.is_dataclass(token) and not isinstance(token, type):
        for name in field_names(type(token)):
            yield from scalars(getattr(token, name), f"{field}.{name}" if field else name)
