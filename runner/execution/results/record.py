"""What a run leaves: the records of its log, hashed in their canonical form, and samples of its signals."""

from __future__ import annotations

import hashlib
import struct
from array import array
from collections.abc import Callable, Iterable
from functools import cache, lru_cache
from typing import Any, Protocol, TypeVar

import numpy as np

from epicycle.actors import Moment, Tag

from .encoding import DOUBLE, INTEGER, canonical, encoders, field_values

T = TypeVar("T")

Names = tuple[str, str, str, "int | None", str]  # event, actor, port, channel, aspect

_MANY = 10_000  # records at one tag
_EDGE = 2**63  # of the whole numbers that have eight bytes
_FULL = 65_536  # bytes that are hashed together
_TAG = struct.Struct("<bq").pack
_SIMPLE = frozenset({float, int, bool, type(None), str, np.float64})  # types whose tokens cannot change


class RecordHash:
    """SHA-256 over records in the canonical form of docs/semantics.md.

    A token is often logged several times: by its sender, by channels that pass it on, by aspects on its way.  One that
    cannot change is encoded once.
    """

    __slots__ = ("_hash", "_known", "_names", "_tag", "buffer", "count", "most", "when")

    def __init__(self) -> None:
        self.count = 0  # records
        self.most = _MANY  # of these, until many at one tag are reported
        self._hash = hashlib.sha256()
        self.buffer = bytearray()  # still to be hashed
        self._names = 0  # different names so far
        self._tag = b""  # of the last record
        self.when: Tag | Moment | None = None  # an object that represents it
        self._known: dict[int, tuple[Any, bytes]] = {}  # tokens that cannot change, with their bytes, by id

    def come_to(self, when: Tag | Moment) -> None:
        """Begin the records of a tag, unless that of the last record is the same."""
        self.when = when
        tag = _TAG(0, when.time) + unsigned(when.microstep)
        if tag != self._tag:
            self._tag, self.most = tag, self.count + _MANY
            self.buffer += tag

    def new_number(self) -> bytes:
        """A number for new names, by which records refer to them."""
        self._names += 1
        return unsigned(self._names)

    def encoded(self, token: Any) -> bytes:
        """The bytes of a token."""
        known = self._known.get(id(token))
        if known is not None and known[0] is token:  # in a copy of a run, tokens have other ids
            return known[1]
        data = encoders[type(token)](token)
        if is_fixed(token):
            self._known[id(token)] = token, data
        return data

    def update(self) -> None:
        """Hash what has been appended."""
        self._hash.update(self.buffer)
        self.buffer.clear()
        self._known.clear()

    def hexdigest(self) -> str:
        """The SHA-256 so far, as hexadecimal text."""
        self.update()
        return self._hash.hexdigest()


class Log(Protocol):
    """What a writer needs to know of its log."""

    hash: RecordHash

    def keep(self, when: Tag | Moment, names: Names, value: Any) -> None:
        """Keep a record."""

    def report(self, when: Tag | Moment, names: Names, number: int) -> None:
        """Report very many records at one tag."""


class Writer:
    """Appends records with the same names to a log; each needs only a tag and a value."""

    __slots__ = ("_hash", "_keeps", "_number", "log", "names")

    def __init__(self, log: Log, names: Names, keeps: bool) -> None:
        self.names = names
        self.log = log
        self._hash = log.hash
        self._number = b""  # of these names; none before the first record
        self._keeps = keeps

    def write(self, when: Tag | Moment, value: Any) -> None:
        """Append a record; raises an exception, and appends nothing, if the value cannot be logged."""
        hashed = self._hash
        cls = type(value)
        if (cls is float or cls is np.float64) and value == value:  # noqa: PLR0124  so it is no NaN
            data = DOUBLE(b"f", value)
        elif cls is int and -_EDGE <= value < _EDGE:
            data = INTEGER(b"i", value)
        else:
            data = hashed.encoded(value)
        if when is not hashed.when:
            hashed.come_to(when)
        buffer = hashed.buffer
        buffer += (self._number or self._introduced()) + data
        if len(buffer) > _FULL:
            hashed.update()
        hashed.count = count = hashed.count + 1
        if count > hashed.most:
            hashed.most += _MANY + 1
            self.log.report(when, self.names, _MANY + 1)
        if self._keeps:
            self.log.keep(when, self.names, value)

    def _introduced(self) -> bytes:
        """Give the names a number; returns both."""
        event, actor, port, channel, aspect = self.names
        self._number = self._hash.new_number()
        return self._number + b"".join(map(canonical, (event, actor, port, aspect, channel)))


@lru_cache
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
