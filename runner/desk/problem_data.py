"""Problems as plain data, for programs: ``epicycle validate --json``."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..model.text.problems import Problem
from .changes import Edit, fix
from .knowledge import Knowledge
from .reading import Reading


def report(reading: Reading) -> dict[str, Any]:
    """Whether a file is valid, and everything that is wrong with it."""
    knowledge = Knowledge(reading)
    problems = [as_data(each, fix(knowledge, each)) for each in reading.problems]
    return {"valid": reading.is_valid, "problems": problems, "more": reading.more}


def as_data(problem: Problem, edit: Edit | None = None) -> dict[str, Any]:
    """A problem: its code, message, place and help, and the change that removes it; lines and columns count from 1."""
    found: dict[str, Any] = {
        "code": problem.kind.code,
        "kind": problem.kind.title,
        "severity": problem.severity,
        "message": problem.message,
        "file": None,
    }
    if (at := problem.position) is not None:
        found |= {"file": at.file, "line": at.line, "column": at.column, "length": at.length}
    found["help"] = list(problem.help)
    if edit is not None:
        found["fix"] = {
            "file": str(edit.path),
            "line": edit.line + 1,
            "column": edit.start + 1,
            "length": edit.end - edit.start,
            "text": edit.text,
        }
    return found


def of_problems(problems: Iterable[Problem], more: bool = False) -> dict[str, Any]:
    """The same for problems of what no desk has read, such as a study with its plan."""
    found = [as_data(each) for each in problems]
    return {"valid": all(each["severity"] != "error" for each in found), "problems": found, "more": more}
