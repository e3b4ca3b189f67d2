"""Places in a text: characters from its beginning, our lines and columns, and how clients count lines and columns.

The lines of the Language Server Protocol end only at CR and LF, and its columns are code units.  All count from 0, and
we do not count a byte order mark.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from functools import lru_cache

from ..model.text.document import LINE_BREAK

_THEIRS = re.compile("\r\n|\n|\r")
_BYTES = {"utf-8": 1, "utf-16": 2, "utf-32": 4}
BOM = "\ufeff"


class Positions:
    """The places of one text; ``encoding`` is that of the client's code units."""

    def __init__(self, text: str, encoding: str = "utf-16") -> None:
        self.text = text
        self._codec, self._size = (f"{encoding}-le" if encoding != "utf-8" else encoding), _BYTES[encoding]
        self._ours, self._theirs = (
            [0, *(found.end() for found in breaks.finditer(text))] for breaks in (LINE_BREAK, _THEIRS)
        )

    def offset(self, line: int, column: int) -> int:
        """The character at our line and column; what is behind the text is at its end."""
        if line >= len(self._ours):
            return len(self.text)
        return min(self._ours[line] + column + (line == 0 and self.text.startswith(BOM)), len(self.text))

    def place(self, offset: int) -> tuple[int, int]:
        """Our line and column of a character."""
        here = bisect_right(self._ours, offset) - 1
        return here, offset - self._ours[here] - (here == 0 and self.text.startswith(BOM))

    def to_client(self, offset: int) -> tuple[int, int]:
        """Line and column of the protocol for a character."""
        there = bisect_right(self._theirs, offset) - 1
        code = self.text[self._theirs[there] : offset].encode(self._codec, "surrogatepass")
        return there, len(code) // self._size

    def from_client(self, line: int, column: int) -> int:
        """The character at a line and column of the protocol."""
        if line >= len(self._theirs):
            return len(self.text)
        start, end = (*self._theirs, len(self.text))[line : line + 2]
        code = self.text[start:end].encode(self._codec, "surrogatepass")[: max(column, 0) * self._size]
        return start + len(code.decode(self._codec, "ignore" if self._size < 4 else "surrogatepass"))


@lru_cache(maxsize=8)
def positions(text: str, encoding: str = "utf-16") -> Positions:
    """The places of a text; those of the latest texts are kept."""
    return Positions(text, encoding)
