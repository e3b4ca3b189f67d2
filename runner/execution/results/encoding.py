"""Tokens as plain data and as canonical bytes, for the event log and its digest.

A token may be a number, a text, None, a list or tuple, a set, a mapping with text keys, a NumPy array, or a dataclass
of these.  Anything else is logged by its ``repr``; if that shows an address instead of a value, the token is refused.
"""

from __future__ import annotations

import dataclasses
import json
import math
import re
import struct
import threading
from collections.abc import Callable, Iterator
from enum import Enum
from functools import cache, lru_cache
from operator import attrgetter, itemgetter
from typing import Any

import numpy as np

from epicycle.actors import EpicycleError

DOUBLE = struct.Struct("<cd").pack
INTEGER = struct.Struct("<cq").pack
_COUNT = struct.Struct("<I").pack


# NaN has many bit patterns, and machines differ in the one that an operation gives.
_NAN = struct.pack("<cQ", b"f", 0x7FF8000000000000)
MOST_NESTED = 64
_ADDRESS = re.compile(r" at 0x[0-9a-fA-F]+")


class TokenError(EpicycleError):
    """A token that cannot be logged."""


@cache
def field_names(cls: type) -> tuple[str, ...]:
    """The fields of a dataclass, in order."""
    return tuple(each.name for each in dataclasses.fields(cls))


@cache
def field_values(cls: type) -> Callable[[Any], tuple[Any, ...]]:
    """A function that gives the values of a dataclass, in the same order."""
    names = field_names(cls)
    if len(names) > 1:
        return attrgetter(*names)
    return lambda token: tuple(getattr(token, name) for name in names)


def plain(token: Any) -> Any:
    """A token as JSON-like data: numbers, texts, lists and dicts."""
    if token is None or isinstance(token, (bool, int, float, str)):
        return token
    if isinstance(token, (np.ndarray, np.generic)):
        value = token.tolist()
        return value if token.dtype.kind in "biufSU" and not isinstance(value, (bytes, np.generic)) else plain(value)
    if isinstance(token, (list, tuple)):
        return [plain(item) for item in token]
    if isinstance(token, (set, frozenset)):
        return [plain(item) for item in sorted(token, key=canonical)]
    if isinstance(token, dict):
        return {str(key): plain(item) for key, item in token.items()}
    if dataclasses.is_dataclass(token) and not isinstance(token, type):
        return {name: plain(getattr(token, name)) for name in field_names(type(token))}
    return _shown(token)


Encode = Callable[[Any], bytes]


class Encoders(dict[type, Encode]):
    """``encoders[type(token)](token)`` is a token as bytes; the encoder of a type is made when it first occurs."""

    def __missing__(self, cls: type) -> Encode:
        encode = self[cls] = _encoder(cls)
        return encode


encoders = Encoders()


def canonical(token: Any) -> bytes:
    """A token as bytes: equal tokens give equal bytes on every machine, tokens of different kinds different ones."""
    return encoders[type(token)](token)


def is_record(cls: type) -> bool:
    """Whether the tokens of a type are encoded field by field."""
    return dataclasses.is_dataclass(cls) and not issubclass(cls, (type, float, np.ndarray))


def _encoder(cls: type) -> Encode:
    """The encoder for the tokens of one type."""
    if issubclass(cls, float):
        return _float
    if cls is np.ndarray:
        return _array
    if issubclass(cls, np.ndarray):
        return lambda token: _array(np.asarray(token))
    if is_record(cls):
        return _fields_encoder(cls)
    if cls is type(None):
        return lambda _: b"n"
    for kinds, encode in _OF_KINDS:
        if issubclass(cls, kinds):
            return encode
    return _other


def _float(token: float) -> bytes:
    return _NAN if token != token else DOUBLE(b"f", token)  # noqa: PLR0124  true of NaN; without a call


def _integer(token: int) -> bytes:
    if -(2**63) <= token < 2**63:
        return INTEGER(b"i", token)
    return b"I" + _text(str(token))


def _scalar(token: Any) -> bytes:
    item = token.item()
    return _other(token) if isinstance(item, np.generic) else canonical(item)


def canonical_inside(token: Any, depth: int) -> bytes:
    """A token as bytes that is within so many others that count."""
    _level.depth += depth
    try:
        return canonical(token)
    finally:
        _level.depth -= depth


class _Level(threading.local):
    """The present nesting depth of the encoder of this thread."""

    depth = 0


_level = _Level()


def _nested(encode: Encode) -> Encode:
    """The encoder for tokens that hold others, up to a limit in case a loop keeps wrapping a token.

    The limit is our own: where Python runs out of stack depends on the caller, and would differ between cores.
    """

    def encode_inside(token: Any) -> bytes:
        _level.depth += 1
        try:
            if _level.depth > MOST_NESTED:
                raise TokenError(
                    f"the token is nested more than {MOST_NESTED} levels deep; does a loop keep putting it into a list?"
                )
            return encode(token)
        finally:
            _level.depth -= 1

    return encode_inside


def _sequence(token: Any) -> bytes:
    return b"l" + _COUNT(len(token)) + b"".join([canonical(item) for item in token])


@_nested
def _mapping(token: Any) -> bytes:
    head = b"m" + _COUNT(len(token))
    names = sorted_names(tuple(token))
    if names is None:
        return head + b"".join(sorted(canonical(key) + canonical(value) for key, value in token.items()))
    return head + b"".join([text + canonical(token[name]) for name, text in names])


@lru_cache(maxsize=1024)  # tokens of one kind have the same keys
def sorted_names(keys: tuple[Any, ...]) -> tuple[tuple[str, bytes], ...] | None:
    """The keys of a mapping, each with its bytes, in the order of these; None if they are not all texts.

    The bytes of no key begin with those of another, so the values have no say in the order.
    """
    if not all(type(key) is str for key in keys):
        return None
    return tuple(sorted(((key, canonical(key)) for key in keys), key=itemgetter(1)))


@_nested
def _set(token: Any) -> bytes:
    return b"e" + _COUNT(len(token)) + b"".join(sorted(map(canonical, token)))


def _other(token: Any) -> bytes:
    return b"r" + _text(_shown(token))


_OF_KINDS: tuple[tuple[Any, Encode], ...] = (
    (bool, lambda token: b"t" if token else b"u"),
    (int, _integer),
    (str, lambda token: b"s" + _text(token)),
    (np.generic, _scalar),
    (list, _nested(_sequence)),
    (tuple, _sequence),
    (dict, _mapping),
    ((set, frozenset), _set),
)


def _fields_encoder(cls: type) -> Encode:
    """The encoder of a dataclass: what all its instances share is encoded here."""
    names = [_text(name) for name in field_names(cls)]
    values = field_values(cls)
    head = b"d" + _text(cls.__qualname__) + _COUNT(len(names))

    def encode(token: Any) -> bytes:
        pieces = [head]
        for name, value in zip(names, values(token), strict=True):
            pieces += (name, encoders[type(value)](value))
        return b"".join(pieces)

    return encode


def _array(token: Any) -> bytes:
    if token.dtype is _FLOAT64 and token.size <= _FEW:  # most of them take half the time
        few: bytes = token.tobytes()
        total = sum(_FEW_NUMBERS[token.size](few))
        if total == total:  # noqa: PLR0124  so no number is NaN
            return _few_head(token.shape) + few
    kind = token.dtype.kind
    if kind not in "biuf":
        return b"A" + canonical(token.dtype.str) + canonical(token.tolist())
    # The maximum of an array with a NaN is NaN; this check takes a quarter of the time of isnan(...).any().
    if kind == "f" and token.size and math.isnan(token.item(token.argmax())):
        token = token.copy()
        token[np.isnan(token)] = np.nan
    data: bytes = token.tobytes()
    return _array_head(token.dtype, token.shape) + data


@cache
def _array_head(dtype: np.dtype[Any], shape: tuple[int, ...]) -> bytes:
    return b"a" + dtype.str.encode() + _COUNT(len(shape)) + b"".join(map(_COUNT, shape))


_FLOAT64 = np.dtype("<f8")
_FEW = 32  # numbers that are checked in Python
_FEW_NUMBERS = [struct.Struct(f"<{size}d").unpack for size in range(_FEW + 1)]


@cache
def _few_head(shape: tuple[int, ...]) -> bytes:
    return _array_head(_FLOAT64, shape)


def _shown(token: Any) -> str:
    text = repr(token)
    if _ADDRESS.search(text):
        raise TokenError(
            f"a token of type {type(token).__name__} has no value that can be logged: make it a dataclass, or give it "
            "a __repr__ that shows its contents"
        )
    return text


def _text(text: str) -> bytes:
    data = text.encode("utf-8", "surrogatepass")
    return _COUNT(len(data)) + data


def leaves(token: Any, field: str = "") -> Iterator[tuple[str, Any]]:
    """The leaves of a token, with the names of their places, such as ``("position[0]", 1.5)``.

    An empty container, such as an empty list, is itself a leaf.
    """
    found: Iterator[tuple[str, Any]] | None = None
    if isinstance(token, np.ndarray) and token.ndim == 0:
        yield field, token.item()
        return
    if isinstance(token, (np.ndarray, list, tuple)):
        found = ((f"{field}[{index}]", item) for index, item in enumerate(token))
    elif isinstance(token, dict):
        found = ((f"{field}.{key}" if field else str(key), item) for key, item in token.items())
    elif dataclasses.is_dataclass(token) and not isinstance(token, type):
        names = field_names(type(token))
        found = ((f"{field}.{name}" if field else name, getattr(token, name)) for name in names)
    is_leaf = True
    for place, item in found or ():
        is_leaf = False
        yield from leaves(item, place)
    if is_leaf:
        yield field, token


Cell = tuple[str, float | None, str | None]


def cell(leaf: Any) -> Cell:
    """A leaf in the columns of a table: its type, its value as a float, its text.

    Numbers have a value and truth values 0 or 1; a text has itself, a member of an enumeration its name, and anything
    else what the event log shows of it.  An int that no float equals has its digits as text, too.  None has neither.
    """
    if leaf is None:
        return "none", None, None
    if isinstance(leaf, Enum):
        return type(leaf).__name__, cell(leaf.value)[1], leaf.name or str(leaf)
    if isinstance(leaf, (bool, np.bool_)):
        return "bool", float(leaf), None
    if isinstance(leaf, (int, np.integer)):
        try:
            value = float(leaf)
        except OverflowError:  # too large for a float
            value = math.inf if leaf > 0 else -math.inf
        return "int", value, None if value == leaf else str(int(leaf))
    if isinstance(leaf, (float, np.floating)):
        return "float", float(leaf), None
    shown = plain(leaf)
    kind = "text" if isinstance(leaf, str) else type(leaf).__name__
    return kind, None, shown if isinstance(shown, str) else json.dumps(shown)
