"""Finds phrases that are hard to read: ``python -m tests.prose`` says where, with exit code 1.

The phrases are in ``prose.yaml``.  Checked are documents, and of Python files every text and comment: docstrings,
messages, what declarations carry.
"""

from __future__ import annotations

import ast
import io
import re
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import yaml

ROOT = Path(__file__).parents[1]
FOLDERS = ("actors", "api", "aspects", "bridges", "ptolemy", "runner", "website")
MADE = ("docs/reference.md",)  # of what declarations say, which are looked at where they stand


class Prose(NamedTuple):
    """A piece of text, and the line at which it begins."""

    line: int
    text: str


class Finding(NamedTuple):
    """A phrase that should be another."""

    path: str
    line: int
    phrase: str
    instead: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: '{self.phrase}': {self.instead}"


def phrases() -> dict[re.Pattern[str], str]:
    """The expressions to look for, and what to write instead of what they match."""
    listed = yaml.safe_load((ROOT / "tests" / "prose.yaml").read_text(encoding="utf-8"))
    return {re.compile(each.replace(" ", r"\s+"), re.I): instead for each, instead in listed.items()}


def of_markdown(document: str) -> Iterator[Prose]:
    """The document without code, its lines where they were."""

    def blank(found: re.Match[str]) -> str:
        return re.sub(r"[^\n]", " ", found[0])

    document = re.sub(r"^ *(```+).*?^ *\1$|<!--.*?-->", blank, document, flags=re.M | re.S)
    yield Prose(1, re.sub(r"`[^`\n]*`", lambda found: "x" * len(found[0]), document))


def of_python(source: str) -> Iterator[Prose]:
    """Texts with a space in them, the values in them as ``x``, and comments."""
    tree = ast.parse(source)
    in_formatted = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in node.values}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            text = "".join(part.value if isinstance(part, ast.Constant) else "x" for part in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in in_formatted:
            text = node.value
        else:
            continue
        if " " in text:
            yield Prose(node.lineno, text)
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield Prose(token.start[0], token.string)


def sources() -> Iterator[Path]:
    """The files that are looked at."""
    yield from (ROOT / name for name in ("README.md", "CONTRIBUTING.md"))
    for path in sorted((ROOT / "docs").rglob("*.md")):
        if path.relative_to(ROOT).as_posix() not in (*MADE, "docs/style.md"):  # which shows what is to be avoided
            yield path
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*.py")):
            yield path


def findings(text: str, path: str, listed: dict[re.Pattern[str], str]) -> Iterator[Finding]:
    """What is found in the text of a file."""
    for piece in of_python(text) if path.endswith(".py") else of_markdown(text):
        for pattern, instead in listed.items():
            for found in pattern.finditer(piece.text):
                line = piece.line + piece.text.count("\n", 0, found.start())
                yield Finding(path, line, " ".join(found[0].split()), instead)


def main() -> int:
    """Print what is found; exit code 1 if that is something."""
    listed = phrases()
    found = [
        each
        for path in sources()
        for each in findings(path.read_text(encoding="utf-8"), path.relative_to(ROOT).as_posix(), listed)
    ]
    for each in sorted(found):
        print(each)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
