"""A model of 300 lines with an included file, in a folder of its own, and places in its texts."""

from __future__ import annotations

from pathlib import Path

MODELS = Path(__file__).parents[2] / "models"
NAME = "changing_roles.yaml"


def folder_with_model(folder: Path) -> Path:
    """Copy the model and what it includes."""
    for name in (NAME, "robots/mobile_robot.yaml"):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text((MODELS / name).read_text(encoding="utf-8"), encoding="utf-8")
    return folder / NAME


def offset(text: str, before: str, behind: str = "") -> int:
    """How many characters are before the place where one text ends and another begins; it must be there once."""
    assert text.count(before + behind) == 1, f"{text.count(before + behind)} times {before + behind!r}"
    return text.index(before + behind) + len(before)


def place(text: str, before: str, behind: str = "") -> tuple[int, int]:
    """The same as line and column, from 0."""
    start = text[: offset(text, before, behind)]
    return start.count("\n"), len(start) - start.rfind("\n") - 1
