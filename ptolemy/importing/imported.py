"""Imports a MoML file: returns the text of a model and notes about it."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from epicycle.actors import Actor, EpicycleError, visible_lines
from epicycle.actors.expression import BudgetError

from .composites import Conversion, said_of
from .document import Entity, MomlError, director_of, read_model
from .limits import Notes, limited_steps
from .writing import Flow, Names, document


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
            text = _text(read_model(path, notes), path.name, notes, own)
    except BudgetError as error:
        raise MomlError(f"{path.name} cannot be imported: {error}") from None
    except RecursionError:
        raise MomlError(f"{path.name}: the model is nested too deeply") from None
    if notes.errors:
        told = "\n".join(f"   - {each}" for each in notes.errors)
        raise MomlError(f"{path.name} cannot be imported:\n{told}")
    if load is not None:
        _check(text, path.name, load)
    return Imported(text, (*notes.lines, notes.summary()))


def _text(model: Entity, file: str, notes: Notes, own: Mapping[str, type[Actor]]) -> str:
    director = director_of(model)
    conversion = Conversion(model, notes, own)
    body = conversion.body(conversion.root)
    name = Names().of(model.name or Path(file).stem)
    said = {} if director is None else said_of(director, conversion.root, notes)
    run = Flow({"stop": said.pop("stop")} if "stop" in said else {})
    for key, value in said.items():
        notes.error(f"the {key} of the model, {value}, has no counterpart")
    for key in ("inputs", "outputs"):
        if body.pop(key, None):
            notes.note(f"the {key} of the model are connected to nothing and are left out")
    head = {"model": name, "parameters": conversion.parameters(conversion.root)}
    sections = {**head, "director": Flow({"like": "ptolemy"}), "composites": conversion.classes, **body}
    lines = [f"# Imported from {file}, a model of Ptolemy II; {notes.summary()}."]
    lines += [f"# - {visible_lines(' '.join(each.split()))}" for each in notes.lines]
    return "\n".join([*lines, document({key: value for key, value in sections.items() if value} | {"run": run})])


def _check(text: str, file: str, load: Callable[[Path], object]) -> None:
    """Load the text that is to be written; raises ``MomlError`` with the reason if that fails."""
    with tempfile.TemporaryDirectory() as folder:
        written = Path(folder) / f"{Path(file).stem}.yaml"
        written.write_text(text, encoding="utf-8")
        try:
            load(written)
        except EpicycleError as error:
            reason = str(error).replace(f"{folder}/", "")
            raise MomlError(f"{file} cannot be imported: the result is not a valid model\n{reason}") from None
