"""Packs data of a page in columns: differences of whole numbers, bytes of equal significance together, compressed.

``browser/data.js`` reads what ``Pack`` writes.  Bytes of equal significance change little from row to row, so zlib
compresses them well: an event takes a few bytes.
"""

from __future__ import annotations

import json
import struct
import zlib
from base64 import b64encode
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from epicycle.actors import visible_lines

LEVEL = 6  # of compression: a higher one takes several times as long and saves a few per cent

Column = tuple[str, int, int]  # its kind (i, f or d), offset, and number of values


class Pack:
    """Packs columns of numbers, and a JSON object that states where each is, into one text."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._size = 0

    def whole(self, numbers: Sequence[int]) -> Column:
        """A column of 32-bit whole numbers."""
        values = np.asarray(numbers, dtype=np.int64)
        return self._put("i", np.diff(values, prepend=0).astype("<i4"))  # wraps, and is read accordingly

    def exact(self, numbers: Sequence[float] | NDArray[np.float64]) -> Column:
        """A column of 64-bit numbers."""
        return self._put("d", np.asarray(numbers, dtype="<f8").ravel())

    def rough(self, numbers: Sequence[float] | NDArray[np.float64]) -> Column:
        """A column of 32-bit numbers, precise enough for a screen; of 64 if some are too large or small for that."""
        values = np.asarray(numbers, dtype=float).ravel()
        with np.errstate(over="ignore", under="ignore"):
            found = values.astype("<f4")
        is_near = np.isclose(found, values, rtol=1e-6, atol=0.0, equal_nan=True)
        return self._put("f", found) if is_near.all() else self.exact(values)

    def texts(self, texts: Iterable[str]) -> tuple[Column, Column]:
        """Texts, with what would be hidden in them: a column of bytes, and one with the length of each."""
        coded = [visible_lines(text).encode("utf-8", "replace") for text in texts]
        joined = np.frombuffer(b"".join(coded), dtype=np.uint8)
        return self._put("b", joined), self.whole([len(each) for each in coded])

    def _put(self, kind: str, values: Any) -> Column:
        size = values.dtype.itemsize
        planes = np.ascontiguousarray(values).view(np.uint8).reshape(-1, size).T.tobytes()
        column = (kind, self._size, len(values))
        self._parts.append(planes)
        self._size += len(planes)
        return column

    def text(self, about: Any) -> str:
        """Everything as base64; hidden characters in it are shown, as in all our HTML."""
        head = json.dumps(_visible(about), ensure_ascii=True, separators=(",", ":"), allow_nan=False).encode()
        return b64encode(zlib.compress(b"".join((struct.pack("<I", len(head)), head, *self._parts)), LEVEL)).decode()


def _visible(data: Any) -> Any:
    """Plain data, all texts of which are visible."""
    if isinstance(data, str):
        return visible_lines(data)
    if isinstance(data, dict):
        return {key: _visible(each) for key, each in data.items()}
    return [_visible(each) for each in data] if isinstance(data, (list, tuple)) else data
