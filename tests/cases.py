"""Files with many cases of wrong input, each with the whole message.

A case is ``### its name``, ``$ option value`` lines for what stands on the command line, the text that is wrong,
``>>>``, and the message.  ``# file: NAME`` within the text begins another file.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

_CASE = re.compile(r"^### ([^\n]+)\n((?:\$ [^\n]*\n)*)(.*?)^>>>\n(.*?)(?=^### |\Z)", re.MULTILINE | re.DOTALL)


class Case(NamedTuple):
    """One wrong text."""

    name: str
    options: tuple[tuple[str, str], ...]
    text: str
    message: str

    def files(self, first: str) -> dict[str, str]:
        """The files of the text by their names."""
        parts = re.split(r"^# file: (.+)\n", self.text, flags=re.MULTILINE)
        return dict(zip([first, *parts[1::2]], parts[::2], strict=True))


def read(path: Path) -> list[Case]:
    """All cases of a file."""
    cases = []
    for name, lines, text, message in _CASE.findall(path.read_text(encoding="utf-8")):
        options = [line.removeprefix("$ ").partition(" ") for line in lines.splitlines()]
        cases.append(Case(name, tuple((key, value) for key, _, value in options), text, message.rstrip("\n") + "\n"))
    return cases


def write(path: Path, say: Callable[[Case], str]) -> None:
    """Put the present messages into a file."""
    texts = []
    for case in read(path):
        lines = "".join(f"$ {key} {value}\n" for key, value in case.options)
        texts.append(f"### {case.name}\n{lines}{case.text}>>>\n{say(case)}\n")
    path.write_text("".join(texts).rstrip("\n") + "\n", encoding="utf-8")
