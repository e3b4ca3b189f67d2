"""CONTRIBUTING.md leads to the right file: what it names exists, and it names what answers questions of new readers."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").partition("\n## How a YAML text")[2]
PLACES = (
    "",
    "runner",
    "runner/model",
    "runner/execution",
    "runner/interface",
)  # where a path of CONTRIBUTING.md may begin
QUESTIONS: list[dict[str, Any]] = yaml.safe_load((ROOT / "tests/contributing/questions.yaml").read_text("utf-8"))


def named() -> Iterator[tuple[str, set[Path]]]:
    """Each file or folder that a line of a table names, and where it may be: a bare name is beside the one before."""
    for line in TEXT.splitlines():
        if not line.startswith("|"):
            continue
        package = re.match(r"\| `(\w+)` ", line)
        of_row = [ROOT / place / package[1] for place in PLACES if place] if package else []
        beside = next((path for path in of_row if (path / "__init__.py").is_file()), None)
        for name in re.findall(r"`([\w/*]+(?:/|\.\w+))`", line):
            found = {path for place in PLACES for path in (ROOT / place).glob(name.rstrip("/"))}
            if beside is not None and "/" not in name[:-1]:
                found |= set(beside.glob(name.rstrip("/")))
            yield name, found
            if found and "/" in name[:-1]:
                beside = next(iter(found)) if name.endswith("/") else next(iter(found)).parent


def test_what_it_names_exists() -> None:
    assert [name for name, found in named() if not found] == []


@pytest.mark.parametrize("each", QUESTIONS, ids=lambda each: Path(each["file"]).stem)
def test_it_names_the_answer(each: dict[str, Any]) -> None:
    assert ROOT / each["file"] in set().union(*(found for _, found in named()))
