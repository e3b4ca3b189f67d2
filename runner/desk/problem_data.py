"""Problems as plain data, for programs: ``epicycle validate --json``."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..model.text.problems import Problem
from .changes import fix
from .knowledge import Knowledge
from .positions import positions


def report(problems: Iterable[Problem] = (), more: bool = False, knowledge: Knowledge | None = None) -> dict[str, Any]:
    """Whether something is valid, and all that is wrong with it; by what is known of a text, with what removes it."""
    found = [as_data(each) | (_fix(knowledge, each) if knowledge else {}) for each in problems]
    return {"valid": all(each["severity"] != "error" for each in found), "problems": found, "more": more}


def _fix(knowledge: Knowledge, problem: Problem) -> dict[str, Any]:
    """The change that removes a problem."""
    if (edit := fix(knowledge, problem)) is None:
        return {}
    line, column = positions(dict(knowledge.reading.files.values())[edit.path]).place(edit.start)
    place = {"file": str(edit.path), "line": line + 1, "column": column + 1, "length": edit.end - edit.start}
    return {"fix": {**place, "text": edit.text}}


def as_data(problem: Problem) -> dict[str, Any]:
    """A problem: its code, message, place and help; lines and columns count from 1."""
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
    return found
