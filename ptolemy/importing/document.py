"""Reads a MoML file: its elements are carried out as they come; nothing is fetched or expanded.

MoML is a list of instructions: an element creates what it names, or changes it if it exists.  An instance of a class
that the file defines starts as a copy of it.  The result: entities with ports, relations, links and attributes.

A file of Ptolemy II names its DTD on the line before the first element.  That line is blanked, and any other part of a
DTD is refused, so a file can neither define nor request entities.
"""

from __future__ import annotations

import pickle
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any
from xml.sax import SAXParseException
from xml.sax.handler import ContentHandler

from epicycle.actors import EpicycleError

from .limits import Notes, spend
from .table import WORDS, table

COMPOSITE = "ptolemy.actor.TypedCompositeActor"
BYTES = 10  # of a copy, for a step


@dataclass
class Property:
    """An attribute: its Java class, its text, and its own attributes."""

    name: str
    java: str = ""
    value: str | None = None
    properties: dict[str, Property] = field(default_factory=dict)

    @property
    def kind(self) -> str:
        """The name of its Java class without the package."""
        return self.java.rpartition(".")[2]

    def text(self, name: str) -> str | None:
        """The value of one of its attributes."""
        found = self.properties.get(name)
        return None if found is None else found.value

    def word(self, name: str, default: str = "") -> str:
        """The value of one of its attributes without blanks and quotes around it."""
        return (self.text(name) or default).strip().strip('"')


@dataclass
class Port(Property):
    """A port that the file mentions."""

    def flag(self, name: str) -> bool:
        """Whether it is an ``input``, ``output`` or ``multiport``."""
        found = self.properties.get(name)
        return found is not None and (found.value or "true").strip() != "false"


@dataclass
class Link:
    """A port's link to a relation; without one, ``relation`` is None and the link only occupies a channel."""

    relation: str | None
    order: int  # of creation


@dataclass
class Entity(Property):
    """An actor, a composite, or a state."""

    ports: dict[str, Port] = field(default_factory=dict)
    entities: dict[str, Entity] = field(default_factory=dict)
    classes: dict[str, Entity] = field(default_factory=dict)
    relations: dict[str, Property] = field(default_factory=dict)  # and the transitions of a state machine
    # The links of each port ("actor.port", or "port" for one of its own), in the order of its channels.
    links: dict[str, list[Link]] = field(default_factory=dict)
    joined: list[tuple[str, str, int]] = field(default_factory=list)  # linked relations, and their order of creation
    of_class: str = ""  # the class in the file that it instantiates

    def everything(self) -> Iterator[Entity]:
        """The entity and everything inside it."""
        yield self
        for each in self.entities.values():
            yield from each.everything()

    def down(self, names: list[str]) -> Entity | None:
        """An entity inside, by the names on the path to it."""
        found: Entity | None = self
        for name in names:
            found = None if found is None else found.classes.get(name) or found.entities.get(name)
        return found


def copied(entity: Entity) -> Entity:
    """A copy of an entity, paid by its size."""
    data = pickle.dumps(entity)  # much faster than deepcopy
    spend(len(data) // BYTES)
    found: Entity = pickle.loads(data)
    return found


def director_of(entity: Entity) -> Property | None:
    """The composite's own director, if it has one."""
    found = [each for each in entity.properties.values() if each.kind.endswith("Director") and not is_layout(each)]
    return found[-1] if found else None


def version_of(model: Entity) -> tuple[int, int]:
    """The version of Ptolemy that wrote a model; a recent one if the file does not state it."""
    said = re.match(r"(\d+)\.(\d+)", model.text("_createdBy") or "")
    return (int(said[1]), int(said[2])) if said is not None else (11, 0)


# -- kinds of attributes ----------------------------------------------------------------------------------------------

# Which are written on several lines.
_LAYOUT, _DECORATION = (re.compile(table("words")[name].replace(" ", "")) for name in ("layout", "decoration"))


def is_text(said: Property) -> bool:
    """Whether the value is used as written, except for ``$name``."""
    return said.kind in WORDS["texts"] or said.text("_stringMode") == "true"


def is_variable(said: Property) -> bool:
    """Whether expressions may name it."""
    return said.value is not None and (
        said.kind.endswith(("Parameter", "Variable", "ParameterSet")) or said.kind in ("", "Priority")
    )


def is_priority(said: Property) -> bool:
    """Whether an attribute is its owner's priority."""
    return said.name == "_priority" or said.kind == "Priority"


def is_layout(said: Property) -> bool:
    """Whether an attribute only concerns a model's appearance or its authoring history."""
    return bool(_LAYOUT.search(said.java)) or (said.name.startswith("_") and said.name != "_priority")


def is_decoration(said: Property) -> bool:
    """Whether an attribute holds an aspect's settings for a port or an actor."""
    return bool(_DECORATION.search(said.java)) or said.name.startswith("DecoratorAttributesFor")


def is_aside(said: Property) -> bool:
    """Whether an attribute says nothing about its owner's own work."""
    return is_layout(said) or is_decoration(said)


# -- reading ----------------------------------------------------------------------------------------------------------


MAX_BYTES = 20_000_000
MAX_ELEMENTS = 300_000
MAX_DEPTH = 100
MAX_ENTITIES = 20_000
MAX_CHANNEL = 1000
_REFUSED = ("deleteEntity", "deletePort", "deleteProperty", "deleteRelation", "rename", "unlink", "group")
_DOCTYPE = re.compile(
    rb"""<!DOCTYPE\s+[\w.:-]+(?:\s+PUBLIC\s+(?:"[^"<>]*"|'[^'<>]*')|\s+SYSTEM)?(?:\s+(?:"[^"<>]*"|'[^'<>]*'))?\s*>"""
)
_PROLOG = re.compile(
    rb"(?:\xef\xbb\xbf)?\s*(?:<\?xml[^>]*\?>)?(?:\s|<!--(?:(?!-->).){0,100000}-->|<\?(?:(?!\?>).){0,100000}\?>)*",
    re.DOTALL,
)


class MomlError(EpicycleError):
    """A file that cannot be imported; the message states why and where."""


def read_model(path: Path, notes: Notes) -> Entity:
    """The model of a file; ``notes`` get what could not be done.  Raises ``MomlError``."""
    # Imported here because no other command needs it.
    from defusedxml.common import DefusedXmlException
    from defusedxml.expatreader import DefusedExpatParser

    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        raise MomlError(f"{path} cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if len(data) > MAX_BYTES:
        raise MomlError(f"{path} is larger than the maximum of {MAX_BYTES:,} bytes")
    builder = _Builder(str(path), notes)
    parser: Any = DefusedExpatParser(forbid_dtd=True)
    parser.setContentHandler(builder)
    try:
        parser.parse(BytesIO(_without_doctype(data)))
    except DefusedXmlException:
        raise MomlError(
            f"{path}:{parser.getLineNumber()}: the file declares entities or its own DTD, which is not allowed\n"
            "   help: only a line like '<!DOCTYPE entity PUBLIC ...>' may precede the model"
        ) from None
    except SAXParseException as error:
        raise MomlError(f"{path}:{error.getLineNumber()}: not well-formed XML: {error.getMessage()}") from None
    except (ValueError, LookupError) as error:  # an encoding unknown to Python
        raise MomlError(f"{path}: not well-formed XML: {error}") from None
    if builder.root is None:
        raise MomlError(f"{path}: the file is empty")
    return builder.root


def _without_doctype(data: bytes) -> bytes:
    """The text with the line that names the DTD blanked, so that lines keep their numbers."""
    prolog = _PROLOG.match(data)
    found = None if prolog is None else _DOCTYPE.match(data, prolog.end())
    return data if found is None else data[: found.start()] + re.sub(rb"[^\n]", b" ", found[0]) + data[found.end() :]


class _Builder(ContentHandler):
    """Makes the model; what is open are the things that elements inside belong to, or None to leave these out."""

    def __init__(self, file: str, notes: Notes) -> None:
        super().__init__()
        self.root: Entity | None = None
        self._file, self._notes = file, notes
        self._open: list[Property | None] = []
        self._elements = self._entities = self._links = 0
        self._locator: Any = None

    def setDocumentLocator(self, locator: Any) -> None:  # noqa: N802  the name is SAX's
        self._locator = locator

    def startElement(self, name: str, attrs: Any) -> None:  # noqa: N802
        self._elements += 1
        if self._elements > MAX_ELEMENTS:
            raise MomlError(f"{self._file}: more than the maximum of {MAX_ELEMENTS:,} elements")
        if len(self._open) >= MAX_DEPTH:
            raise self._error(f"elements are nested deeper than {MAX_DEPTH} levels")
        said = dict(attrs.items())
        if self.root is None:
            if name not in ("entity", "class", "model"):
                raise self._error(f"<{name}> is not a model: MoML starts with <entity>")
            self.root = self._made(name, self._name(name, said), said)
            self._open.append(self.root)
            return
        around = self._open[-1] if self._open else None
        self._open.append(None if around is None else self._within(around, name, said))

    def endElement(self, name: str) -> None:  # noqa: N802
        self._open.pop()

    def skippedEntity(self, name: str) -> None:  # noqa: N802
        raise self._error(f"unknown entity &{name};")

    def _error(self, text: str) -> MomlError:
        return MomlError(f"{self._file}:{self._locator.getLineNumber()}: {text}")

    def _tell(self, text: str) -> None:
        self._notes.note(f"line {self._locator.getLineNumber()}: {text}")

    def _name(self, tag: str, said: Mapping[str, str]) -> str:
        if "name" not in said:
            raise self._error(f"<{tag}> has no name")
        return said["name"]

    # -- entities and properties ------------------------------------------------------------------------------------

    def _within(self, owner: Property, tag: str, said: Mapping[str, str]) -> Property | None:
        """Apply an element to what contains it; returns what elements inside it belong to."""
        match tag:
            case "property" | "director":  # the latter in the first version of MoML
                for name in self._name(tag, said).split("."):
                    owner = owner.properties.setdefault(name, Property(name))
                return self._about(owner, said)
            case _ if tag in _REFUSED:
                self._notes.error(f"line {self._locator.getLineNumber()}: <{tag}> is not supported")
            case _ if not isinstance(owner, Entity):
                return None
            case "port":
                name = self._name(tag, said)
                return self._about(owner.ports.setdefault(name, Port(name)), said)
            case "relation":
                name = self._name(tag, said)
                return self._about(owner.relations.setdefault(name, Property(name)), said)
            case "entity" | "model" | "class":
                return self._child(owner, tag, said)
            case "link":
                self._link(owner, said)
            case "input" | "import":
                self._tell(f"the file {said.get('source')!r} is not read")
            case _ if tag not in ("configure", "display", "doc", "location", "rendition", "vertex"):
                self._tell(f"<{tag}> is not supported and is left out")
        return None

    def _child(self, entity: Entity, tag: str, said: Mapping[str, str]) -> Entity | None:
        name = self._name(tag, said)
        *path, last = [name] if name.startswith(".") else name.split(".")
        home = entity.down(path)
        if home is None:
            self._tell(f"{name!r}: there is no entity {'.'.join(path)!r}")
            return None
        kin = home.classes if tag == "class" else home.entities
        if last not in kin or ("class" in said and last not in home.entities):
            kin[last] = self._made(tag, last, said)
        return kin[last]

    def _made(self, tag: str, name: str, said: Mapping[str, str]) -> Entity:
        """A new entity or class."""
        java = said.get("extends") or said.get("class") or COMPOSITE
        pattern = self._class(java)
        self._entities += 1 if pattern is None else sum(1 for _ in pattern.everything())
        if self._entities > MAX_ENTITIES:
            raise self._error(f"more than the maximum of {MAX_ENTITIES:,} entities")
        if "source" in said:
            self._tell(f"{name}: the file {said['source']!r} is not read")
        if pattern is None:
            return Entity(name, java)
        made = copied(pattern)
        made.name = name
        made.of_class = pattern.of_class if tag != "class" and pattern.of_class else pattern.name
        return made

    def _class(self, name: str) -> Entity | None:
        """The class of that name visible inside the open entities; None if the file defines none."""
        around = [each for each in self._open if isinstance(each, Entity)]
        first, *parts = name.removeprefix(".").split(".")
        if name.startswith("."):
            return around[0].down(parts) if around and around[0].name == first else None
        return next((found for each in reversed(around) if (found := each.down([first, *parts])) is not None), None)

    def _about(self, owner: Property, said: Mapping[str, str]) -> Property:
        owner.java = said.get("class") or owner.java
        owner.value = said.get("value", owner.value)
        return owner

    # -- links ----------------------------------------------------------------------------------------------------

    def _link(self, entity: Entity, said: Mapping[str, str]) -> None:
        self._links += 1
        port, relation = said.get("port"), said.get("relation")
        text = said.get("insertAt") or said.get("insertInside") or ""
        place = int(text) if text.isdecimal() and len(text) < 7 else None
        if "relation1" in said and "relation2" in said:
            entity.joined.append((said["relation1"], said["relation2"], self._links))
        elif port is None:
            self._tell("a link without a port is left out")
        elif relation is not None and relation not in entity.relations:
            self._tell(f"the link of {port} is left out: there is no relation {relation!r}")
        elif place is not None and place > MAX_CHANNEL:
            self._tell(f"the link of {port} is left out: its channel {place} is above the limit of {MAX_CHANNEL}")
        else:
            links = entity.links.setdefault(port, [])
            links += [Link(None, 0) for _ in range((place or 0) - len(links))]
            links.insert(len(links) if place is None else place, Link(relation, self._links))
