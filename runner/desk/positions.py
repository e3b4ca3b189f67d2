"""Places in a text: our lines and columns, characters from its beginning, and how clients count both.

Browsers count code units from the beginning; the Language Server Protocol has lines that end only at CR and LF, and
columns in code units.  All count from 0, and we do not count a byte order mark.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from functools import cached_property

from ..model.text.document import LINE_BREAK

_THEIRS = re.compile("\r\n|\n|\r")
_BYTES = {"utf-8": 1, "utf-16": 2, "utf-32": 4}
BOM = "\ufeff"


class Positions:
    """The places of one text; ``encoding`` is that of the client's code units."""

    def __init__(self, text: str, encoding: str = "utf-16") -> None:
        self.text = text
        self._codec, self._size = (f"{encoding}-le" if encoding != "utf-8" else encoding), _BYTES[encoding]
        self._is_simple = text.isascii()
        self._ours = [0, *(found.end() for found in LINE_BREAK.finditer(text))]

    def offset(self, line: int, column: int) -> int:
        """The character at our line and column; what is behind the text is at its end."""
        if line >= len(self._ours):
            return len(self.text)
        return min(self._ours[line] + column + (line == 0 and self.text.startswith(BOM)), len(self.text))

    def place(self, offset: int) -> tuple[int, int]:
        """Our line and column of a character."""
        here = bisect_right(self._ours, offset) - 1
        return here, offset - self._ours[here] - (here == 0 and self.text.startswith(BOM))

    def units(self, offset: int, start: int = 0) -> int:
        """The code units between two characters."""
        if self._is_simple:
            return offset - start
        return len(self.text[start:offset].encode(self._codec, "surrogatepass")) // self._size

    def at_units(self, units: int, start: int = 0, end: int | None = None) -> int:
        """The character that is so many code units behind another, and not behind the end."""
        end = len(self.text) if end is None else end
        if self._is_simple:
            return min(max(start + units, start), end)
        code = self.text[start:end].encode(self._codec, "surrogatepass")[: max(units, 0) * self._size]
        return start + len(code.decode(self._codec, "ignore" if self._size < 4 else "surrogatepass"))

    # -- the Language Server Protocol -----------------------------------------------------------------------------

    @cached_property
    def _theirs(self) -> list[int]:
        return [0, *(found.end() for found in _THEIRS.finditer(self.text))]

    def to_client(self, line: int, column: int) -> tuple[int, int]:
        """Line and column of the protocol for ours."""
        offset = self.offset(line, column)
        there = bisect_right(self._theirs, offset) - 1
        return there, self.units(offset, self._theirs[there])

    def from_client(self, line: int, column: int) -> tuple[int, int]:
        """Our line and column for those of the protocol."""
        if line >= len(self._theirs):
            return len(self._ours), 0
        end = self._theirs[line + 1] if line + 1 < len(self._theirs) else None
        return self.place(self.at_units(column, self._theirs[line], end))
