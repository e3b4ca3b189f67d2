"""Records as bytes, many at a time; compiled, where a compiler was there (``packing.pyx``)."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any, Final

from epicycle.actors import When

AS_THEY_ARE: Final[frozenset[type]] = frozenset()  # types of tokens that wait to be packed; Python is no faster so

_TAG: Final = struct.Struct("<cqcq").pack  # as ``canonical`` writes two integers


def stamp(when: When) -> bytes:
    """A tag in bytes."""
    return _TAG(b"i", when.time, b"i", when.microstep)


def packed(pieces: list[Any], encode: Callable[[Any], bytes]) -> bytes:
    """All pieces one after the other: three for each record, of which the last are bytes or tokens to ``encode``.

    Tokens are often logged again and again, by who sends them, by channels that hand them on, by aspects on their way:
    their bytes are made once.
    """
    made: dict[int, bytes] = {}
    for place in range(2, len(pieces), 3):
        token = pieces[place]
        if type(token) is not bytes:
            known = made.get(id(token))
            if known is None:
                known = made[id(token)] = encode(token)
            pieces[place] = known
    return b"".join(pieces)
