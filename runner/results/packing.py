"""Records as bytes, many at a time; compiled if there was a compiler (``packing.pyx``)."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any, Final

from epicycle.actors import When

TAKES_NUMBERS: Final = False  # whether a sheet encodes them at once: in Python that is no faster
_TAG: Final = struct.Struct("<cqcq").pack  # as ``canonical`` writes two integers


def stamp(when: When) -> bytes:
    """A tag in bytes."""
    return _TAG(b"i", when.time, b"i", when.microstep)


class Sheet:
    """Records that wait until the event log encodes them, many at a time."""

    __slots__ = ("_pieces", "_stamp", "size")

    def __init__(self) -> None:
        self.size = 0  # records
        self._stamp = b""
        self._pieces: list[Any] = []  # three for each: tag, names, what is kept of the value

    def turn_to(self, when: When) -> None:
        """The following records have this tag."""
        self._stamp = stamp(when)

    def add(self, head: bytes, value: Any) -> bool:
        """Add a record if its value is a number or similarly simple."""
        return False

    def keep(self, head: bytes, kept: Any) -> None:
        """Add a record, with the bytes of its value, or with a token that cannot change until it is encoded."""
        self._pieces.extend((self._stamp, head, kept))
        self.size += 1

    def taken(self, encode: Callable[[Any], bytes]) -> bytes:
        """Take all records out, as bytes.

        Tokens are often logged several times, by their sender, by channels that pass them on, by aspects on their way:
        they are encoded once.
        """
        made: dict[int, bytes] = {}
        pieces, self._pieces, self.size = self._pieces, [], 0
        for place in range(2, len(pieces), 3):
            token = pieces[place]
            if type(token) is not bytes:
                known = made.get(id(token))
                if known is None:
                    known = made[id(token)] = encode(token)
                pieces[place] = known
        return b"".join(pieces)
