"""Places as the Language Server Protocol counts them: its lines end only at CR and LF, its columns count code units."""

from __future__ import annotations

import re
from bisect import bisect_right

_OURS = re.compile("\r\n|[\n\r\x85\u2028\u2029]")
_THEIRS = re.compile("\r\n|\n|\r")
_BYTES = {"utf-8": 1, "utf-16": 2, "utf-32": 4}
BOM = "\ufeff"


class Positions:
    """The places of one text; ``encoding`` is what both sides agreed to count."""

    def __init__(self, text: str, encoding: str) -> None:
        self.text = text
        self._codec, self._size = (f"{encoding}-le" if encoding != "utf-8" else encoding), _BYTES[encoding]
        self._ours = [0, *(found.end() for found in _OURS.finditer(text))]
        self._theirs = [0, *(found.end() for found in _THEIRS.finditer(text))]

    def to_client(self, line: int, column: int) -> tuple[int, int]:
        """Line and column of the protocol for ours, all from 0; YAML does not count a byte order mark."""
        offset = len(self.text)  # what is missing there may be said to be missing behind the end
        if line < len(self._ours):
            offset = min(self._ours[line] + column + (line == 0 and self.text.startswith(BOM)), offset)
        there = bisect_right(self._theirs, offset) - 1
        units = self.text[self._theirs[there] : offset].encode(self._codec, "surrogatepass")
        return there, len(units) // self._size

    def from_client(self, line: int, column: int) -> tuple[int, int]:
        """Our line and column for those of the protocol."""
        if line >= len(self._theirs):
            return len(self._ours), 0
        start = self._theirs[line]
        end = self._theirs[line + 1] if line + 1 < len(self._theirs) else len(self.text)
        units = self.text[start:end].encode(self._codec, "surrogatepass")[: column * self._size]
        offset = start + len(units.decode(self._codec, "ignore" if self._size < 4 else "surrogatepass"))
        here = bisect_right(self._ours, offset) - 1
        return here, offset - self._ours[here] - (here == 0 and self.text.startswith(BOM))
