"""Imports a MoML file: returns the text of a model and notes about it."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from epicycle.actors import Actor, visible_lines
from epicycle.actors.expression import BudgetError

from .actors import seconds
from .budget import limited_steps
from .channels import join_channels
from .composites import Conversion
from .directors import director_of, said_of
from .document import MomlError, read_document
from .entities import Builder, Entity
from .former import rename_former
from .higher_order import plain_composites
from .instances import expand_instances
from .iterations import plain_iterations
from .names import Names
from .notes import Notes
from .publishing import plain_channels
from .writing import Flow, block

LIKE = {"like": "ptolemy"}
"""The director of an imported model."""


@dataclass(frozen=True)
class Imported:
    """The result of importing a MoML file."""

    text: str
    notes: tuple[str, ...]


def import_moml(path: Path, load: Callable[[Path], object] | None = None, types: Iterable[type] = ()) -> Imported:
    """Import a file; raises ``MomlError`` with everything that prevents it.

    ``load`` is called with a file that holds the result, and must raise its errors.  ``types`` are the user's actors:
    one with the name of a Java class replaces it.
    """
    notes = Notes()
    own = {each.__name__: each for each in types if issubclass(each, Actor)}
    try:
        with limited_steps():
            root = Builder(path.name, lambda text, line: notes.note(f"line {line}: {text}")).build(read_document(path))
            text = _text(root, path.name, notes, own)
    except BudgetError as error:
        raise MomlError(f"{path.name} cannot be imported: {error}") from None
    except RecursionError:
        raise MomlError(f"{path.name}: the model is nested too deeply") from None
    if notes.errors:
        raise MomlError(_refusal(path.name, notes.errors))
    if load is not None:
        _check(text, path.name, load)
    return Imported(text, (*notes.lines, notes.summary()))


def _refusal(name: str, reasons: list[str]) -> str:
    told = "\n".join(f"   - {each}" for each in reasons)
    return f"{name} cannot be imported:\n{told}"


def _text(model: Entity, file: str, notes: Notes, own: Mapping[str, type[Actor]]) -> str:
    rename_former(model)
    expand_instances(model, notes)
    plain_composites(model, notes)
    plain_iterations(model, notes)
    plain_channels(model, notes)
    join_channels(model, notes)
    conversion = Conversion(model, notes, own)
    level = conversion.level(model, "")
    body = conversion.body(level)
    sections: dict[str, Any] = {"model": Names().of(model.name or Path(file).stem)}
    if "doc" in body:
        sections["doc"] = body.pop("doc")
    run: dict[str, Any] = {}
    said: dict[str, Any] = {}
    if (director := director_of(model)) is not None:
        said = said_of(director, director.name, level.scope, notes, of_model=True)
    start = _start(said)
    if (stop := said.pop("stop", None)) is not None:
        run["stop"] = seconds(max(stop - start, 0.0))
    if parameters := conversion.parameters(level):
        sections["parameters"] = Flow(parameters)
    sections["director"] = Flow(LIKE)
    if said:
        notes.note("the model has its own time: it becomes a composite with its own director")
        body = _inside(sections["model"], body, sections.pop("parameters", None), said, conversion)
    for key in ("inputs", "outputs"):
        if body.pop(key, None):
            notes.note(f"the {key} of the model are connected to nothing and are left out")
    if conversion.classes:
        sections["composites"] = conversion.classes
    sections |= body
    sections["run"] = Flow(run)
    lines = [*_comment(file, notes), *block(sections)]
    return "\n".join(lines) + "\n"


def _inside(
    name: str, body: dict[str, Any], parameters: object, said: dict[str, Any], conversion: Conversion
) -> dict[str, Any]:
    """The body of a model with one composite, which contains everything and has its own clock."""
    kind = conversion.class_name(name)
    head = {"parameters": parameters} if parameters is not None else {}
    conversion.classes[kind] = {**head, "director": Flow(said), **body}
    return {"actors": {kind: Flow({"type": kind})}}


def _start(said: Mapping[str, Any]) -> float:
    return float(str(said.get("start", "0 s")).removesuffix(" s"))


def _comment(file: str, notes: Notes) -> list[str]:
    lines = [f"# Imported from {file}, a model of Ptolemy II; {notes.summary()}."]
    return lines + [f"# - {visible_lines(' '.join(each.split()))}" for each in notes.lines]


def _check(text: str, file: str, load: Callable[[Path], object]) -> None:
    """Load the text that is to be written; raises ``MomlError`` with the reason if that fails."""
    from epicycle.actors import EpicycleError

    with tempfile.TemporaryDirectory() as folder:
        written = Path(folder) / f"{Path(file).stem}.yaml"
        written.write_text(text, encoding="utf-8")
        try:
            load(written)
        except EpicycleError as error:
            reason = str(error).replace(f"{folder}/", "")
            raise MomlError(f"{file} cannot be imported: the result is not a valid model\n{reason}") from None
