"""The model of a MoML file: entities with ports, relations, links and attributes.

Classes are expanded in their instances: an entity only keeps the name of its class.
"""

from __future__ import annotations

import pickle
import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from .budget import spend
from .tables import WORDS, pattern

COMPOSITE = "ptolemy.actor.TypedCompositeActor"
PARAMETER = "ptolemy.data.expr.Parameter"
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
class Relation(Property):
    """A relation, or the transition of a state machine."""


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
    relations: dict[str, Relation] = field(default_factory=dict)
    # The links of each port ("actor.port", or "port" for one of its own), in the order of its channels.
    links: dict[str, list[Link]] = field(default_factory=dict)
    joined: list[tuple[str, str, int]] = field(default_factory=list)  # linked relations, and their order of creation
    of_class: str = ""  # the class in the file that it instantiates
    doc: str = ""

    def everything(self) -> Iterator[Entity]:
        """The entity and everything inside it."""
        yield self
        for each in self.entities.values():
            yield from each.everything()

    def link(self, relation: str, order: int, *ports: str) -> None:
        """Link ports to a relation, which is made if there is none of that name."""
        self.relations.setdefault(relation, Relation(relation))
        for port in ports:
            self.links.setdefault(port, []).append(Link(relation, order))

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

_LAYOUT, _DECORATION = pattern("layout"), pattern("decoration")


def is_text(said: Property) -> bool:
    """Whether the value is used as written, except for ``$name``."""
    return said.kind in WORDS["texts"] or said.text("_stringMode") == "true"


def is_variable(said: Property) -> bool:
    """Whether expressions may name it."""
    return said.value is not None and (
        said.kind.endswith(("Parameter", "Variable", "ParameterSet")) or said.kind in ("", "Priority")
    )


def is_layout(said: Property) -> bool:
    """Whether an attribute only concerns a model's appearance or its authoring history."""
    return bool(_LAYOUT.search(said.java)) or (said.name.startswith("_") and said.name != "_priority")


def is_decoration(said: Property) -> bool:
    """Whether an attribute holds an aspect's settings for a port or an actor."""
    return bool(_DECORATION.search(said.java)) or said.name.startswith("DecoratorAttributesFor")


def is_aside(said: Property) -> bool:
    """Whether an attribute says nothing about its owner's own work."""
    return is_layout(said) or is_decoration(said)
