"""Builds the model of a MoML file: entities with ports, relations and links; classes are expanded in their instances.

MoML is a list of instructions: an element creates what it names, or changes it if it exists.  An instance of a class
that the file defines starts as a copy of it.  The result therefore has no classes; an entity only keeps the name of its
class.
"""

from __future__ import annotations

import pickle
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from .budget import COPY, spend
from .document import Element, MomlError

MAX_ENTITIES = 20_000
ABSTRACT_COMPOSITE = "ptolemy.actor.TypedCompositeActor"


@dataclass
class Property:
    """An attribute: its Java class, its text, and its own attributes."""

    name: str
    java: str = ""
    value: str | None = None
    line: int = 0
    properties: dict[str, Property] = field(default_factory=dict)
    configure: str = ""
    own: bool = True  # whether it is set here rather than by a class

    def text(self, name: str) -> str | None:
        """The value of one of its attributes."""
        found = self.properties.get(name)
        return None if found is None else found.value


def kind(said: Property) -> str:
    """The name of its Java class without the package."""
    return said.java.rpartition(".")[2]


@dataclass
class Port(Property):
    """A port that the file mentions."""

    def flag(self, name: str) -> bool:
        """Whether it is an ``input``, ``output`` or ``multiport``."""
        found = self.properties.get(name)
        return found is not None and (found.value or "true").strip() != "false"


@dataclass
class Relation(Property):
    """A relation, or the transition of a state machine."""


@dataclass
class Link:
    """A port's link to a relation; without one, ``relation`` is None and the link only occupies a channel."""

    port: str  # "actor.port", or "port" for one of the composite itself
    relation: str | None
    line: int
    order: int  # of creation


@dataclass
class Entity(Property):
    """An actor, a composite, or a state."""

    ports: dict[str, Port] = field(default_factory=dict)
    entities: dict[str, Entity] = field(default_factory=dict)
    classes: dict[str, Entity] = field(default_factory=dict)
    relations: dict[str, Relation] = field(default_factory=dict)
    # The links of each port, in the order of its channels; for the composite's own ports, those inside.
    links: dict[str, list[Link]] = field(default_factory=dict)
    joined: list[tuple[str, str, int]] = field(default_factory=list)  # linked relations, and their order of creation
    of_class: str = ""  # the class in the file that it instantiates
    doc: str = ""

    def everything(self) -> Iterator[Entity]:
        """The entity and everything inside it."""
        yield self
        for each in self.entities.values():
            yield from each.everything()


Tell = Callable[[str, int], None]


class Builder:
    """Carries out the elements of the named file; ``tell`` receives what could not be done."""

    def __init__(self, name: str, tell: Tell) -> None:
        self._file = name
        self._tell = tell
        self._count = self._links = 0

    def build(self, root: Element) -> Entity:
        """The model of a file; raises ``MomlError``."""
        while root.tag == "group" and len(root.children) == 1:
            root = root.children[0]
        if root.tag not in ("entity", "class", "model"):
            raise MomlError(f"{self._file}:{root.line}: <{root.tag}> is not a model: MoML starts with <entity>")
        return self._made(root, [])

    def _made(self, element: Element, around: list[Entity]) -> Entity:
        """A new entity or class."""
        name = self._name(element)
        java = element.get("extends") or element.get("class") or ABSTRACT_COMPOSITE
        pattern = self._class(java, around)
        if pattern is None:
            self._enter(1, element)
            made = Entity(name, java, line=element.line)
        else:
            self._enter(sum(1 for _ in pattern.everything()), element)
            made = copied(pattern)
            made.name, made.line = name, element.line
            made.of_class = pattern.of_class if element.tag != "class" and pattern.of_class else pattern.name
            _inherited(made)
        if element.get("source"):
            self._tell(f"{name}: the file {element.get('source')!r} is not read", element.line)
        self._fill(made, element, around)
        return made

    def _enter(self, count: int, element: Element) -> None:
        self._count += count
        if self._count > MAX_ENTITIES:
            raise MomlError(f"{self._file}:{element.line}: more than the maximum of {MAX_ENTITIES:,} entities")

    def _name(self, element: Element) -> str:
        name = element.get("name")
        if name is None:
            raise MomlError(f"{self._file}:{element.line}: <{element.tag}> has no name")
        return name

    def _class(self, name: str, around: list[Entity]) -> Entity | None:
        """The class of that name visible inside these entities; None if the file defines none."""
        if name.startswith("."):
            found: Entity | None = around[0] if around else None
            first, *parts = name[1:].split(".")
            if found is None or found.name != first:
                return None
            return _down(found, parts)
        parts = name.split(".")
        for each in reversed(around):
            if (found := _down(each, parts)) is not None:
                return found
        return None

    def _fill(self, entity: Entity, element: Element, around: list[Entity]) -> None:
        inside = [*around, entity]
        for child in element.children:
            self._do(entity, child, inside)

    def _do(self, entity: Entity, child: Element, inside: list[Entity]) -> None:
        """Apply one element to the entity that contains it."""
        match child.tag:
            case "property":
                self._property(entity, child)
            case "port":
                port = entity.ports.setdefault(self._name(child), Port(self._name(child), line=child.line))
                self._about(port, child)
            case "entity" | "model" | "class":
                self._child(entity, child, inside)
            case "relation":
                name = self._name(child)
                relation = entity.relations.setdefault(name, Relation(name, line=child.line))
                self._about(relation, child)
            case "link":
                self._link(entity, child)
            case "unlink":
                self._unlink(entity, child)
            case "deleteEntity" | "deletePort" | "deleteRelation" | "deleteProperty":
                self._delete(entity, child)
            case "rename":
                entity.name = self._name(child)
            case "group":
                for each in child.children:
                    self._do(entity, each, inside)
            case "doc":
                entity.doc = child.text.strip()
            case "director":  # in the first version of MoML
                self._property(entity, child)
            case "configure":
                entity.configure = child.text.strip()
            case "input" | "import":
                self._tell(f"the file {child.get('source')!r} is not read", child.line)
            case "display" | "rendition" | "location" | "vertex":
                pass
            case tag:
                self._tell(f"<{tag}> is not supported and is left out", child.line)

    def _child(self, entity: Entity, child: Element, inside: list[Entity]) -> None:
        name = self._name(child)
        *path, last = name.split(".") if not name.startswith(".") else [name]
        home = _down(entity, path) if path else entity
        if home is None:
            self._tell(f"{name!r}: there is no entity {'.'.join(path)!r}", child.line)
            return
        kin = home.classes if child.tag == "class" else home.entities
        if last in kin and (child.get("class") is None or last in home.entities):
            self._fill(kin[last], child, inside)  # adds to an existing entity
            return
        made = self._made(Element(child.tag, {**child.attributes, "name": last}, child.line, child.children), inside)
        kin[last] = made

    def _property(self, owner: Property, element: Element) -> None:
        name = self._name(element)
        *path, last = name.split(".")
        for each in path:
            owner = owner.properties.setdefault(each, Property(each, line=element.line))
        found = owner.properties.setdefault(last, Property(last, line=element.line))
        self._about(found, element)

    def _about(self, owner: Property, element: Element) -> None:
        """Apply an element to a property, port or relation."""
        owner.java = element.get("class") or owner.java
        owner.line, owner.own = element.line, True
        if (value := element.get("value")) is not None:
            owner.value = value
        for child in element.children:
            if child.tag in ("property", "director"):
                self._property(owner, child)
            elif child.tag == "configure":
                owner.configure = child.text.strip()
            elif child.tag == "deleteProperty":
                owner.properties.pop(child.get("name") or "", None)
            elif child.tag == "entity" and child.get("name"):  # a model inside an attribute
                owner.properties.setdefault(str(child.get("name")), Property(str(child.get("name")), line=child.line))

    # -- links ----------------------------------------------------------------------------------------------------

    def _next(self) -> int:
        self._links += 1
        return self._links

    def _link(self, entity: Entity, element: Element) -> None:
        one, other = element.get("relation1"), element.get("relation2")
        if one is not None and other is not None:
            entity.joined.append((one, other, self._next()))
            return
        port, relation = element.get("port"), element.get("relation")
        if port is None:
            self._tell("a link without a port is left out", element.line)
            return
        if relation is not None and relation not in entity.relations:
            self._tell(f"the link of {port} is left out: there is no relation {relation!r}", element.line)
            return
        links = entity.links.setdefault(port, [])
        place = _number(element.get("insertAt") or element.get("insertInside"))
        if place is None:
            links.append(Link(port, relation, element.line, self._next()))
            return
        if place > 1000:
            self._tell(f"the link of {port} is left out: its channel {place} is above the limit of 1000", element.line)
            return
        links += [Link(port, None, element.line, 0) for _ in range(place - len(links))]
        links.insert(place, Link(port, relation, element.line, self._next()))

    def _unlink(self, entity: Entity, element: Element) -> None:
        one, other = element.get("relation1"), element.get("relation2")
        if one is not None and other is not None:
            entity.joined = [pair for pair in entity.joined if {*pair[:2]} != {one, other}]
            return
        links = entity.links.get(element.get("port") or "", [])
        place = _number(element.get("index") or element.get("insideIndex"))
        if place is not None and place < len(links):
            del links[place]
        elif (relation := element.get("relation")) is not None:
            links[:] = [each for each in links if each.relation != relation]

    def _delete(self, entity: Entity, element: Element) -> None:
        name = self._name(element)
        match element.tag:
            case "deleteEntity":
                entity.entities.pop(name, None)
                for port in [port for port in entity.links if port.rpartition(".")[0] == name]:
                    del entity.links[port]
            case "deletePort":
                home = _down(entity, [element.get("entity") or ""]) if element.get("entity") else entity
                if home is not None:
                    home.ports.pop(name, None)
                entity.links.pop(f"{element.get('entity')}.{name}" if element.get("entity") else name, None)
            case "deleteRelation":
                entity.relations.pop(name, None)
                for links in entity.links.values():
                    links[:] = [each for each in links if each.relation != name]
                entity.joined = [pair for pair in entity.joined if name not in pair]
            case _:
                entity.properties.pop(name, None)


def copied(entity: Entity) -> Entity:
    """A copy of an entity, paid by the number of its parts."""
    spend(COPY * sum(1 for each in entity.everything() for _ in _parts(each)))
    found: Entity = pickle.loads(pickle.dumps(entity))  # much faster than deepcopy
    return found


def _parts(said: Property) -> Iterator[object]:
    """What something consists of besides other entities: itself, and properties, ports, relations and links."""
    yield said
    inside: list[Property] = [*said.properties.values()]
    if isinstance(said, Entity):
        yield from said.joined
        for links in said.links.values():
            yield from links
        inside += [*said.ports.values(), *said.relations.values(), *said.classes.values()]
    for each in inside:
        yield from _parts(each)


def _inherited(entity: Entity) -> None:
    """Mark everything that is here so far as coming from a class."""
    for each in entity.everything():
        for owner in (each, *each.ports.values()):
            for said in owner.properties.values():
                said.own = False


def version_of(model: Entity) -> tuple[int, int]:
    """The version of Ptolemy that wrote a model; a recent one if the file does not state it."""
    said = re.match(r"(\d+)\.(\d+)", model.text("_createdBy") or "")
    return (int(said[1]), int(said[2])) if said is not None else (11, 0)


def _down(entity: Entity, names: list[str]) -> Entity | None:
    """An entity inside another, by the names on the path to it."""
    for name in names:
        found = entity.classes.get(name) or entity.entities.get(name)
        if found is None:
            return None
        entity = found
    return entity


def _number(text: str | None) -> int | None:
    return int(text) if text is not None and text.isdecimal() and len(text) < 7 else None
