"""Changes of texts: what removes a problem, and another name for something, in all files that use it."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from difflib import SequenceMatcher
from itertools import accumulate
from pathlib import Path
from typing import Any

from epicycle.actors import EpicycleError, Parameter

from ..model.text.document import Mapping as MappingNode
from ..model.text.problems import Position, Problem
from ..model.text.reading import NAME, NAMES_HAVE
from .knowledge import Knowledge, owner_of
from .names import Name
from .places import positions, value_of, walk
from .reading import NO_TEXTS, Reading, Texts, read

_PLAIN = re.compile(r"[A-Za-z0-9_.+*/^%° -]+\Z")


@dataclass(frozen=True)
class Edit:
    """A text in place of a stretch of a file, which counts characters from its beginning."""

    path: Path
    start: int
    end: int
    text: str


class RenameError(EpicycleError):
    """A name that cannot be changed, or not into that one."""


def apply(text: str, edits: Iterable[Edit]) -> str:
    """A text with changes, of which no two overlap."""
    for edit in sorted(edits, key=lambda each: each.start, reverse=True):
        text = text[: edit.start] + edit.text + text[edit.end :]
    return text


def edits_between(path: Path, before: str, after: str) -> list[Edit]:
    """What makes one text of another: the lines that differ, and of these the characters."""
    one, other = before.splitlines(keepends=True), after.splitlines(keepends=True)
    starts = [0, *accumulate(map(len, one))]
    found = []
    for what, a, b, c, d in SequenceMatcher(None, one, other, autojunk=False).get_opcodes() if before != after else ():
        old, new = "".join(one[a:b]), "".join(other[c:d])
        if what == "equal":
            continue
        most = min(len(old), len(new))
        same = next((at for at in range(most) if old[at] != new[at]), most)
        behind = next((at for at in range(most - same) if old[-1 - at] != new[-1 - at]), most - same)
        found.append(Edit(path, starts[a] + same, starts[b] - behind, new[same : len(new) - behind]))
    return found


# -- fixes ------------------------------------------------------------------------------------------------------------


def fix(knowledge: Knowledge, problem: Problem) -> Edit | None:
    """The change that a problem asks for, if a program may make it."""
    found = problem.fix
    if found is None or (at := found.position).file not in knowledge.reading.files:
        return None
    if found.key:
        return _missing(knowledge, at, found.key)
    text = at.source[at.column - 1 : at.column - 1 + at.length]
    quote = text[:1] if text[:1] in "'\"" and text[-1:] == text[:1] else ""
    new = found.text if not quote or _PLAIN.match(found.text) is None else f"{quote}{found.text}{quote}"
    return Edit(*knowledge.stretch(at), new)


def fix_all(knowledge: Knowledge) -> list[Edit]:
    """The changes that all problems ask for, the first one at each place."""
    found: dict[tuple[Path, int], Edit] = {}
    for problem in knowledge.reading.problems:
        if (edit := fix(knowledge, problem)) is not None:
            found.setdefault((edit.path, edit.start), edit)
    return list(found.values())


def _missing(knowledge: Knowledge, at: Position, key: str) -> Edit | None:
    """A value for a parameter that has none, after the type of the part whose name is at a position."""
    root = knowledge.reading.nodes.get(at.file)
    for each in walk(root) if root is not None else ():
        owner, keys = owner_of((*each.keys, each.node.text))
        if not each.is_key or each.node.position != at or keys[:-1] not in (("actors",), ("aspects",)):
            continue
        part = value_of(each.around[-1], each.node.text)
        value = sample(knowledge.parameter(owner, (*keys, key)))
        if value is None or not isinstance(part, MappingNode) or "type" not in part.entries:
            return None
        said, start = part.entries["type"], part.position
        path, _, end = knowledge.stretch(said.value.position)
        is_flow = start.source[start.column - 1 : start.column] == "{"
        indent = " " * (said.key.position.column - 1)
        return Edit(path, end, end, f", {key}: {value}" if is_flow else f"\n{indent}{key}: {value}")
    return None


def sample(parameter: Parameter[Any] | None) -> str | None:
    """A value that a parameter takes; None if only its author can know one."""
    if parameter is None or parameter.shape is not None:
        return None
    if parameter.choices:
        return str(next(iter(parameter.choices)))
    if parameter.type is bool:
        return "true"
    if parameter.type not in (int, float, int | float):
        return None
    low, high = parameter.min, parameter.max
    if (low, high) == (0, 1) and parameter.type is not int:
        return "0.1"  # of a share, so that one sees what it does
    value = 1 if (low is None or low <= 1) and (high is None or high >= 1) else low if low is not None else high
    unit = parameter.unit if parameter.unit not in ("", "1") else ""
    return f"{value:g} {unit}".rstrip()


# -- problems as data, for programs ------------------------------------------------------------------------------------


def report(problems: Iterable[Problem] = (), more: bool = False, knowledge: Knowledge | None = None) -> dict[str, Any]:
    """Whether something is valid, and all that is wrong with it; by what is known of a text, with what removes it."""
    found = [as_data(each) | (_fix_data(knowledge, each) if knowledge else {}) for each in problems]
    return {"valid": all(each["severity"] != "error" for each in found), "problems": found, "more": more}


def _fix_data(knowledge: Knowledge, problem: Problem) -> dict[str, Any]:
    """The change that removes a problem."""
    if (edit := fix(knowledge, problem)) is None:
        return {}
    line, column = positions(knowledge.texts[edit.path]).place(edit.start)
    place = {"file": str(edit.path), "line": line + 1, "column": column + 1, "length": edit.end - edit.start}
    return {"fix": {**place, "text": edit.text}}


def as_data(problem: Problem) -> dict[str, Any]:
    """A problem: its code, message, place and help; lines and columns count from 1."""
    at = problem.position
    return {
        "code": problem.kind.code,
        "kind": problem.kind.title,
        "severity": problem.severity,
        "message": problem.message,
        "file": None,
        **({"file": at.file, "line": at.line, "column": at.column, "length": at.length} if at is not None else {}),
        "help": list(problem.help),
    }


# -- names ------------------------------------------------------------------------------------------------------------


def rename(knowledge: Knowledge, offset: int, new: str, texts: Texts = NO_TEXTS) -> list[Edit]:
    """Give what stands at a place another name, wherever it is used; raises ``RenameError``.

    The model afterwards must be what it was before: as many actors, connections, and places of aspects.
    """
    reading, names = knowledge.reading, knowledge.names
    use = knowledge.use_at(offset)
    if use is None:
        raise RenameError("there is no name here that can be changed")
    name, *others = sorted(use.names, key=str)
    if others:
        raise RenameError(f"{name.name!r} stands for several things here: {_owners(use.names)}")
    if not NAME.match(new):
        raise RenameError(f"{new!r} is not a name: {NAMES_HAVE}")
    beside = ("actor", "port", "aspect") if name.kind in ("actor", "port", "aspect") else (name.kind,)
    owners = [each for each in names.classes if name.owner in names.bases(each)]
    if any(names.name_of(each, kind, new) for each in owners for kind in beside):
        raise RenameError(f"there is already {'an' if new[0] in 'aeiou' else 'a'} {new!r} there")
    edits = []
    for each in names.of(name):
        at = each.position
        if len(each.names) > 1:
            raise RenameError(f"{at}: the name stands for several things: {_owners(each.names)}; change it by hand")
        edits.append(Edit(*knowledge.stretch(at), new))
    edits = list(dict.fromkeys(edits))
    _check(reading, edits, name, texts)
    return edits


def _owners(names: Iterable[Name]) -> str:
    return " and ".join(sorted(f"{each.kind} {each.name!r} of {each.owner or 'the model'}" for each in names))


def _check(reading: Reading, edits: list[Edit], name: Name, texts: Texts) -> None:
    """Raise ``RenameError`` if the model would be another one."""
    changed = {path.resolve(): text for path, text in texts_after(reading, edits).items()}
    after = read(reading.path, {**texts, **changed}, reading.types, parsed=reading.parsed)
    if _shape(after) != _shape(reading):
        new = [each for each in after.problems if each.severity == "error"]
        why = str(new[0]) if new and reading.is_valid else "the model would be another one"
        raise RenameError(f"{name.name!r} is also used where it cannot be changed by a program: {why}")


def _shape(reading: Reading) -> object:
    """What a new name must not change."""
    problems = sorted((each.kind.code, each.position.line if each.position else 0) for each in reading.problems)
    model = reading.loading.model
    if model is None:
        return problems
    output, kinds = model.output, Counter(each.kind for each in model.graph.components.values())
    aspects, ports = [len(each.places) for each in model.aspects], [len(each.ports) for each in output.metrics]
    counts = (sorted(kinds.values()), len(list(model.graph.edges)), aspects, len(output.recorded), ports)
    return problems, counts, len(output.monitors), len(model.parameters)


def texts_after(reading: Reading, edits: Iterable[Edit]) -> Mapping[Path, str]:
    """The texts of a model's files after changes, by path."""
    found: dict[Path, list[Edit]] = {}
    for each in edits:
        found.setdefault(each.path, []).append(each)
    texts = dict(reading.files.values())
    return {path: apply(texts[path], each) for path, each in found.items()}
