"""Imports a MoML file: returns the text of a model and notes about it."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from epicycle.actors import Actor, EpicycleError, visible_lines
from epicycle.actors.expression import BudgetError

from .budget import limited_steps
from .channels import join_channels
from .composites import Conversion
from .directors import needs_word, said_of
from .document import MomlError, read_model
from .entities import Entity, director_of
from .iterations import plain_iterations
from .names import Names
from .notes import Notes
from .writing import Flow, block, seconds

LIKE = {"like": "ptolemy"}
"""The director of an imported model."""


@dataclass(frozen=True)
class Imported:
    """The result of importing a MoML file."""

    text: str
    notes: tuple[str, ...]


def import_moml(
    path: Path, load: Callable[[Path], object] | None = None, types: Iterable[type] = (), *, as_de: bool = False
) -> Imported:
    """Import a file; raises ``MomlError`` with everything that prevents it.

    ``load`` is called with a file that holds the result, and must raise its errors.  ``types`` are the user's actors:
    one with the name of a Java class replaces it.  ``as_de``: the actors of a model with an SDF or SR director fire by
    the rules of DE; otherwise such a model is refused.
    """
    notes = Notes()
    own = {each.__name__: each for each in types if issubclass(each, Actor)}
    try:
        with limited_steps():
            text = _text(read_model(path, notes), path.name, notes, own, as_de=as_de)
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


def _text(model: Entity, file: str, notes: Notes, own: Mapping[str, type[Actor]], *, as_de: bool) -> str:
    director = director_of(model)
    if director is not None and needs_word(director) and not as_de:
        notes.error(f"{director.name} is a {director.java}: to let its actors fire by the rules of DE, say --as-de")
    plain_iterations(model, notes)
    join_channels(model, notes)
    conversion = Conversion(model, notes, own)
    body = conversion.body(conversion.root)
    name = Names().of(model.name or Path(file).stem)
    parameters = conversion.parameters(conversion.root)
    head: dict[str, Any] = {"model": name, "doc": body.pop("doc", None)}
    said = {} if director is None else said_of(director, director.name, conversion.root.scope, notes, of_model=True)
    start = float(str(said.get("start", "0 s")).removesuffix(" s"))
    stop = said.pop("stop", None)
    for key in ("inputs", "outputs"):
        if body.pop(key, None):
            notes.note(f"the {key} of the model are connected to nothing and are left out")
    if said:
        notes.note("the model has its own time: it becomes a composite with its own director")
        inner = {"parameters": Flow(parameters), "director": Flow(said), **body}
        body, parameters = conversion.inside(name, {key: value for key, value in inner.items() if value}), {}
    sections = {
        **head, "parameters": Flow(parameters), "director": Flow(LIKE), "composites": conversion.classes, **body,
    }  # fmt: skip
    sections = {key: value for key, value in sections.items() if value}
    run = Flow({} if stop is None else {"stop": seconds(max(stop - start, 0.0))})
    lines = [f"# Imported from {file}, a model of Ptolemy II; {notes.summary()}."]
    lines += [f"# - {visible_lines(' '.join(each.split()))}" for each in notes.lines]
    return "\n".join([*lines, *block({**sections, "run": run})]) + "\n"


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
