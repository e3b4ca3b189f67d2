"""What a text and the installed types say of what stands at a place: types, ports, parameters, paths."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from epicycle.actors import Parameter, UnitError, counted, declared_parameters, declared_ports, has_own_ports, type_name

from ..model.catalogue.metrics import MetricSpec
from ..model.catalogue.reference import doc_of, first_sentence
from ..model.catalogue.types import Catalogue, CatalogueError, figure_types, installed
from ..model.graph.model_graph import ModelGraph
from ..model.language.ports import ParameterText
from ..model.temporal import Requirement
from ..model.text.document import Scalar
from ..model.text.patterns import PatternError, in_general, select
from ..model.text.problems import Position
from .names import MODEL, Names, Use
from .places import Keys, positions, text_of
from .reading import Reading


@dataclass(frozen=True)
class Known:
    """Something that may be written somewhere: it takes the place of so many characters before the cursor.

    ``kind`` is key, type, actor, port, parameter, value, unit, path or function.
    """

    text: str
    kind: str
    what: str = ""
    doc: str = ""
    replaces: int = 0


class Knowledge:
    """What is known while a text is read; the text is ``file``, which may be one that the model includes."""

    def __init__(self, reading: Reading, file: Path | None = None) -> None:
        self.reading = reading
        self.names = Names(reading)
        self.texts = dict(reading.files.values())
        known = reading.files.items()
        self.path = (reading.path if file is None else file).resolve()
        self.file = next((name for name, (path, _) in known if path.resolve() == self.path), reading.name)
        self.text = reading.files[self.file][1] if self.file in reading.files else ""

    def stretch(self, at: Position) -> tuple[Path, int, int]:
        """A position as a file and a stretch of characters."""
        path, text = self.reading.files.get(at.file, (Path(at.file), ""))
        start = positions(text).offset(at.line - 1, at.column - 1)
        return path, start, min(start + at.length, len(text))

    def covers(self, at: Position, offset: int) -> bool:
        """Whether a position is at a place in the file."""
        _, start, end = self.stretch(at)
        return at.file == self.file and start <= offset <= end

    def use_at(self, offset: int) -> Use | None:
        """The use of a name at a place in the file."""
        line = positions(self.text).place(offset)[0] + 1
        here = (each for each in self.names.uses if each.position.line == line)
        return next((each for each in here if self.covers(each.position, offset)), None)

    @cached_property
    def catalogue(self) -> Catalogue:
        return installed().with_types(self.reading.types)

    @property
    def graph(self) -> ModelGraph | None:
        model = self.reading.loading.model
        return None if model is None else model.graph

    # -- types ----------------------------------------------------------------------------------------------------

    def type_called(self, name: str, section: str) -> type | None:
        """The class of an actor, aspect or figure type; None if there is none."""
        with suppress(CatalogueError):
            if section in ("actors", "aspects"):
                return (self.catalogue.actors if section == "actors" else self.catalogue.aspects).get(name)
            return figure_types().get(name)
        return None

    def composite_parameters(self, name: str) -> Mapping[str, ParameterText]:
        """The parameters of a composite class, with what their takers say of them."""
        known = self.reading.loading.known
        found = None if known is None else known.composites.get(name)
        return found.parameters if found else {}

    def parameters_of(self, kind: str, section: str) -> Mapping[str, Parameter[Any]]:
        """The parameters of a type, which may be a composite class."""
        if section in ("actors", "aspects") and kind in self.names.classes:
            return {name: as_parameter(each) for name, each in self.composite_parameters(kind).items()}
        cls = self.type_called(kind, section)
        return {} if cls is None else declared_parameters(cls)

    def parameter(self, owner: str, keys: Keys) -> Parameter[Any] | None:
        """The parameter of which the value is at the end of some keys of a class."""
        if len(keys) < 3 or not isinstance(name := keys[2], str):
            return None
        section, part = str(keys[0]), str(keys[1])
        if section in ("metrics", "monitors"):
            return declared_parameters(MetricSpec if section == "metrics" else Requirement).get(name)
        types = self.names.types_of(owner, part, section)
        return next((each[name] for kind in types if name in (each := self.parameters_of(kind, section))), None)

    def unit_of(self, owner: str, keys: Keys) -> str:
        """The unit of a value; empty if it is no number."""
        if keys == ("run", "stop") or (keys[:1] == ("connections",) and keys[-1:] == ("delay",)):
            return "s"  # these are no parameters
        found = self.parameter(owner, keys)
        return "" if found is None or found.unit in ("", "1") else found.unit

    # -- ports ----------------------------------------------------------------------------------------------------

    def ports_of(self, owner: str, actor: str, direction: str) -> Iterator[Known]:
        """The ports of an actor of a class."""
        for kind in self.names.types_of(owner, actor):
            if kind in self.names.classes:
                yield from self.own_ports(kind, direction)
            elif (cls := self.type_called(kind, "actors")) is not None:
                ports = {name: port for name, port in declared_ports(cls).items() if port.direction == direction}
                if has_own_ports(cls) and (made := self.made(owner, "actors", actor)) is not None:
                    ports |= made.inputs if direction == "input" else made.outputs
                yield from (Known(name, "port", type_name(each.type), each.doc) for name, each in ports.items())

    def own_ports(self, owner: str, direction: str) -> Iterator[Known]:
        """The ports of a class."""
        for name, entry in self.names.declared(owner, f"{direction}s").items():
            said = entry.value.text if isinstance(entry.value, Scalar) and entry.key is not entry.value else ""
            yield Known(name, "port", text_of(entry.value, "type") or said, text_of(entry.value, "doc"))

    # -- paths ----------------------------------------------------------------------------------------------------

    def scope(self, owner: str) -> str | None:
        """What the paths inside the first instance of a class begin with; None if there is none."""
        if owner == MODEL:
            return ""
        found = self.graph.components.items() if self.graph is not None else ()
        return next((f"{path}." for path, each in found if each.kind == owner), None)

    def made(self, owner: str, section: str, name: str) -> Any:
        """The first actor, or woven aspect, that is made of a part of a class; None if there is none yet."""
        model, scope = self.reading.loading.model, self.scope(owner)
        if model is None or scope is None:
            return None
        if section == "aspects":
            return next((each for each in model.aspects if each.name == f"{scope}{name}"), None)
        return model.graph.actors.get(f"{scope}{name}") or model.graph.actors.get(f"{scope}{name}[0]")

    def next_names(self, owner: str, start: str, directions: frozenset[str]) -> Iterator[Known]:
        """What may follow a pattern, which is empty or ends with a dot: components and ports, and what they match."""
        graph, scope = self.graph, self.scope(owner)
        if graph is None or scope is None:
            return
        pattern = f"{scope}{start}*"
        try:
            parts = select(pattern, graph.components)
            ports = select(pattern, (each for each in graph.ports if graph.direction(each) in directions))
        except PatternError:
            return
        kinds = {in_general(path.rpartition(".")[2]): graph.components[path].kind for path in reversed(parts) if path}
        yield from (Known(name, "path", kind) for name, kind in kinds.items())
        for name, number in Counter(path.rpartition(".")[2] for path in ports).items():
            yield Known(name, "path", f"matches {counted(number, 'port')}")
        if not start and kinds:
            yield Known("*", "path", f"matches {counted(len(kinds), 'name')}")

    # -- words ----------------------------------------------------------------------------------------------------

    def of_type(self, name: str, section: str) -> str:
        """What a type is, in a sentence."""
        if name in self.names.classes and name:
            return first_sentence(self.names.said(name, "doc"))
        cls = self.type_called(name, section)
        return "" if cls is None else first_sentence(doc_of(cls))


def as_parameter(said: ParameterText, kind: type = float) -> Parameter[Any]:
    """What a text declares, as types declare it, with values of any kind; bounds whose units are wrong are none."""
    try:
        low, above, high = said.bounds()
    except UnitError:
        low = above = high = None
    made: Parameter[Any] = Parameter(float, unit=said.unit, min=low, above=above, max=high, doc=said.doc)
    made.type, made.choices = kind, tuple(said.choices)
    return made


def owner_of(keys: Keys) -> tuple[str, Keys]:
    """The class that keys of a file lead into, and the rest of them."""
    if keys[:1] == ("composites",) and len(keys) > 1:
        return str(keys[1]), keys[2:]
    return MODEL, keys
