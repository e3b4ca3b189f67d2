"""What a run leaves: the records of its log, hashed in their canonical form, and samples of its signals."""

from __future__ import annotations

import hashlib
import struct
from array import array
from collections.abc import Callable, Iterable
from functools import cache
from typing import Any, TypeVar

import numpy as np

from epicycle.actors import Moment, Tag

from .encoding import encoders, field_values

T = TypeVar("T")

_FULL = 65_536  # bytes that are hashed together
_TAG = struct.Struct("<bq").pack
_SIMPLE = frozenset({float, int, bool, type(None), str, np.float64})  # types whose tokens cannot change


class RecordHash:
    """SHA-256 over records in the canonical form of docs/semantics.md.

    A token is often logged several times: by its sender, by channels that pass it on, by aspects on its way.  One that
    cannot change is encoded once.
    """

    __slots__ = ("_buffer", "_hash", "_known", "_names", "_tag", "_when", "at_tag", "count")

    def __init__(self) -> None:
        self.count = 0  # records
        self.at_tag = 0  # of these, at the last tag
        self._hash = hashlib.sha256()
        self._buffer = bytearray()  # still to be hashed
        self._names = 0  # different names so far
        self._tag = b""  # of the last record
        self._when: Tag | Moment | None = None  # an object that represents it
        self._known: dict[int, tuple[Any, bytes]] = {}  # tokens that cannot change, with their bytes, by id

    def add(self, number: bytes, names: bytes, when: Tag | Moment, value: Any) -> bytes:
        """Append a record; ``number`` is that of its names, empty if they are new.  Returns their number.

        Raises an exception, and appends nothing, if the value cannot be encoded.
        """
        cls = type(value)
        data = encoders[cls](value) if cls in _SIMPLE else self._encoded(value)
        if when is not self._when:
            self._when = when
            tag = _TAG(0, when.time) + unsigned(when.microstep)
            if tag != self._tag:
                self._tag, self.at_tag = tag, 0
                self._buffer += tag
        if not number:
            self._names += 1
            number = unsigned(self._names)
            self._buffer += number + names
        else:
            self._buffer += number
        self._buffer += data
        self.count += 1
        self.at_tag += 1
        if len(self._buffer) > _FULL:
            self._update()
        return number

    def _encoded(self, token: Any) -> bytes:
        known = self._known.get(id(token))
        if known is not None and known[0] is token:  # in a copy of a run, tokens have other ids
            return known[1]
        data = encoders[type(token)](token)
        if is_fixed(token):
            self._known[id(token)] = token, data
        return data

    def _update(self) -> None:
        self._hash.update(self._buffer)
        self._buffer.clear()
        self._known.clear()

    def hexdigest(self) -> str:
        """The SHA-256 so far, as hexadecimal text."""
        self._update()
        return self._hash.hexdigest()


def unsigned(number: int) -> bytes:
    """A whole number as unsigned LEB128: seven bits a byte, the lowest first; the last byte is below 128."""
    data = bytearray()
    while number > 127:
        data.append(number & 127 | 128)
        number >>= 7
    data.append(number)
    return bytes(data)


def is_fixed(token: Any) -> bool:
    """Whether nothing in a token can change."""
    kind: type = type(token)
    if kind in _SIMPLE:
        return True
    if kind is np.ndarray:
        return not token.flags.writeable and token.base is None and token.dtype.kind in "biuf"
    values_of = _values_of_fixed(kind)
    return values_of is not None and all(map(is_fixed, values_of(token)))


@cache
def _values_of_fixed(cls: type) -> Callable[[Any], Iterable[Any]] | None:
    """A function that gives the values in a tuple, or in a frozen dataclass; None for all other types."""
    if cls is tuple:
        return iter
    params = vars(cls).get("__dataclass_params__")
    return field_values(cls) if params is not None and params.frozen else None


class Past(list[T]):
    """Past events of a run, which no longer change: a copy of the run shares the items of the list."""


class Samples:
    """Tags, and tokens that are all floats or all ints: about 20 bytes for both, where objects take 130."""

    __slots__ = ("kind", "microsteps", "times", "tokens")

    def __init__(self) -> None:
        self.times = array("q")
        self.microsteps = array("i")
        self.tokens: Any = array("d")
        self.kind: type | None = float  # type of all tokens; None if there are others, and ``tokens`` is a list

    def add(self, time: int, microstep: int, token: Any) -> None:
        """Append a token."""
        if type(token) is not self.kind and self.kind is not None:
            self._make_room(token)
        # Ctrl-C may come between any two of these lines: a token counts once its microstep is there, which is added
        # last.
        try:
            self.tokens.append(token)
        except OverflowError:  # an int of more than 64 bits
            self.tokens = Past([*self.tokens, token])
            self.kind = None
        self.times.append(time)
        self.microsteps.append(microstep)

    def _make_room(self, token: Any) -> None:
        """Prepare for a token of a different type."""
        if type(token) is int and not self.tokens:
            self.tokens, self.kind = array("q"), int
        else:
            self.tokens, self.kind = Past(self.tokens), None
