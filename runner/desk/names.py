"""The names of a model in its texts: where each is declared, and where it is used."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from epicycle.actors.expression import ExpressionError, names_in

from ..model.text.document import Entry, Node, Scalar, Sequence
from ..model.text.document import Mapping as MappingNode
from ..model.text.problems import Position
from ..model.text.reading import inside
from .reading import Reading

MODEL = ""  # the class of what the model itself declares
# Where a class declares names, and of what kind they are.
SECTIONS = {
    "parameters": "parameter",
    "inputs": "port",
    "outputs": "port",
    "actors": "actor",
    "aspects": "aspect",
    "metrics": "metric",
    "monitors": "monitor",
    "figures": "figure",
    "composites": "composite",
}
_SEGMENT = r"(?:\*\*|(?:\*|[A-Za-z_]\w*)(?:\[[^\]\s]*\])?)"
_DOTTED = re.compile(rf"(?<![\w.\]$])({_SEGMENT}(?:\.{_SEGMENT})+)", re.ASCII)
_WORD = re.compile(r"(?<![\w.])([A-Za-z_]\w*)(?![\w.(\[])", re.ASCII)
_HEAD = re.compile(r"(?<![\w.])([A-Za-z_]\w*)(?:\[[^\]\s]*\])?(?![\w.])", re.ASCII)
_OWN_RULES = ("at", "from", "type", "port")  # keys whose values are more than patterns
_EXPRESSION = re.compile(r"\$\{[^}]*\}")


@dataclass(frozen=True)
class Name:
    """A name that a class declares; the ``owner`` is the first of its bases that does."""

    kind: str
    owner: str
    name: str


@dataclass(frozen=True)
class Use:
    """A place where a name stands; it may stand for several, if a pattern selects in several classes."""

    names: frozenset[Name]
    position: Position
    declares: bool = False


@dataclass
class _Class:
    """The mappings that declare a class: one, and those of the models that a model extends."""

    mappings: list[MappingNode] = field(default_factory=list)

    def entries(self, section: str) -> Iterator[tuple[str, Entry, Position]]:
        """What a section declares, by name."""
        for mapping in self.mappings:
            node = mapping.entries[section].value if section in mapping.entries else None
            if isinstance(node, MappingNode):
                yield from ((name, entry, entry.key.position) for name, entry in node.entries.items())
            elif section in ("inputs", "outputs") and node is not None:
                for item in node.items if isinstance(node, Sequence) else (node,):
                    if isinstance(item, Scalar):
                        yield item.text, Entry(item, item), item.position


class Names:
    """All names in the files of a model."""

    def __init__(self, reading: Reading) -> None:
        self.classes: dict[str, _Class] = defaultdict(_Class)
        for node in reading.nodes.values():
            if isinstance(node, MappingNode):
                self._add(node)
        self._declared: dict[str, dict[str, dict[str, Entry]]] = {}
        for name, each in self.classes.items():
            sections: dict[str, dict[str, Entry]] = defaultdict(dict)
            for section, kind in SECTIONS.items():
                for declared, entry, _ in each.entries(section):
                    sections[kind].setdefault(declared, entry)
            self._declared[name] = sections

    @cached_property
    def uses(self) -> list[Use]:
        """Where names stand; found when somebody asks, which takes longer than to read what is declared."""
        self._found: list[Use] = []
        for name in self.classes:
            self._collect(name)
        return self._found

    def _add(self, node: MappingNode) -> None:
        if "composites" in node.entries and isinstance(found := node.entries["composites"].value, MappingNode):
            for name, entry in found.entries.items():
                if isinstance(entry.value, MappingNode):
                    self.classes[name].mappings.append(entry.value)
        self.classes[MODEL].mappings.append(node)

    # -- what is declared -----------------------------------------------------------------------------------------

    def bases(self, owner: str) -> list[str]:
        """A class and those that it extends, the first one last."""
        found = [owner]
        while owner and (base := self._text(owner, "extends")) and base in self.classes and base not in found:
            found.append(owner := base)
        return found

    def _text(self, owner: str, key: str) -> str:
        entries = (each.entries[key].value for each in self.classes[owner].mappings if key in each.entries)
        return next((each.text for each in entries if isinstance(each, Scalar)), "")

    def declared(self, owner: str, kind: str) -> Mapping[str, Entry]:
        """What a class and its bases declare of a kind, by name."""
        found: dict[str, Entry] = {}
        for each in reversed(self.bases(owner)):
            found |= self._declared.get(each, {}).get(kind, {})
        return found

    def ports(self, owner: str, direction: str) -> list[str]:
        """The names of the ports of a class."""
        found: dict[str, None] = {}
        for each in reversed(self.bases(owner)):
            found |= dict.fromkeys(name for name, _, _ in self.classes[each].entries(f"{direction}s"))
        return list(found)

    def name_of(self, owner: str, kind: str, name: str) -> Name | None:
        """What a name means in a class."""
        for each in reversed(self.bases(owner)):
            if name in self._declared.get(each, {}).get(kind, {}):
                return Name(kind, each, name)
        return None

    def types_of(self, owner: str, actor: str) -> list[str]:
        """The types that an actor, or an aspect, of a class may have; a parameter may choose one."""
        for kind in ("actor", "aspect"):
            for each in self.bases(owner):
                node = self._declared.get(each, {}).get(kind, {}).get(actor)
                said = _entry(node.value, "type") if node is not None else None
                if said is None or not isinstance(said.value, Scalar):
                    continue
                chooser = said.value.text.strip()
                if not chooser.startswith("${"):
                    return [chooser]
                choices = self.declared(owner, "parameter").get(chooser.strip("${ }"))
                node_of_choices = _entry(choices.value, "choices") if choices is not None else None
                return [each.text for each in _scalars(node_of_choices.value)] if node_of_choices is not None else []
        return []

    def inner(self, owner: str, actor: str) -> list[str]:
        """The composite classes that an actor of a class may be."""
        return [each for each in self.types_of(owner, actor) if each in self.classes and each]

    # -- what is used ---------------------------------------------------------------------------------------------

    def at(self, file: str, line: int, column: int) -> Use | None:
        """The use of a name at a place, which counts from 0."""
        for use in self.uses:
            at = use.position
            if at.file == file and at.line == line + 1 and at.column - 1 <= column <= at.column - 1 + at.length:
                return use
        return None

    def of(self, name: Name) -> list[Use]:
        """Where a name stands."""
        return [use for use in self.uses if name in use.names]

    def _use(self, names: Iterable[Name | None], position: Position | None, declares: bool = False) -> None:
        found = frozenset(each for each in names if each is not None)
        if found and position is not None:
            self._found.append(Use(found, position, declares))

    def _collect(self, owner: str) -> None:
        for section, kind in SECTIONS.items():
            if kind == "composite" and owner != MODEL:
                continue
            for name, entry, at in self.classes[owner].entries(section):
                self._use([self.name_of(owner, kind, name)], at, True)
                if kind in ("actor", "aspect"):
                    self._part(owner, name, entry.value)
                elif kind == "parameter" and (choices := _entry(entry.value, "choices")) is not None:
                    for each in _scalars(choices.value):
                        self._use([self._class(each.text)], _whole(each))
        for mapping in self.classes[owner].mappings:
            for key, entry in mapping.entries.items():
                if key == "extends" and owner != MODEL and isinstance(entry.value, Scalar):
                    self._use([self._class(entry.value.text)], _whole(entry.value))
                elif key not in ("composites", "doc", "model", "include", "extends"):
                    self._scan(owner, entry.value, key)

    def _class(self, name: str) -> Name | None:
        return Name("composite", MODEL, name) if name and name in self.classes else None

    def _part(self, owner: str, name: str, node: Node) -> None:
        """The type of an actor or aspect, and the parameters of its class that it sets or inherits."""
        if not isinstance(node, MappingNode):
            return
        classes = self.inner(owner, name)
        for key, entry in node.entries.items():
            if key == "type" and isinstance(entry.value, Scalar):
                self._use([self._class(entry.value.text)], _whole(entry.value))
            self._use([self.name_of(each, "parameter", key) for each in classes], entry.key.position)
            if key == "inherit":
                for each in _scalars(entry.value):
                    named = [self.name_of(holder, "parameter", each.text) for holder in (owner, *classes)]
                    self._use(named, _whole(each))

    def _scan(self, owner: str, node: Node, key: str) -> None:
        """The names in the values under a key of a class."""
        if isinstance(node, Scalar):
            self._scan_text(owner, node, key)
        elif isinstance(node, Sequence):
            for item in node.items:
                self._scan(owner, item, key)
        else:
            kind = _entry(node, "type")
            for name, entry in node.entries.items():
                inner = f"{key}.{name}" if name in _OWN_RULES else key
                if key.endswith(".at") and kind is not None and isinstance(entry.value, Scalar):
                    chosen = kind.value.text if isinstance(kind.value, Scalar) else ""
                    named = self._class(chosen) if name == "type" else self.name_of(chosen, "port", entry.value.text)
                    self._use([named] if name in ("type", "port") else (), _whole(entry.value))
                self._scan(owner, entry.value, inner)

    def _scan_text(self, owner: str, node: Scalar, key: str) -> None:
        text = node.text
        for found in _EXPRESSION.finditer(text):
            try:
                asked = names_in(found[0])
            except ExpressionError:
                continue
            for word in re.finditer(r"(?<![\w.])[A-Za-z_]\w*", found[0]):
                if word[0] in asked:
                    at = _part_of(node, found.start() + word.start(), word[0])
                    self._use([self.name_of(owner, "parameter", word[0])], at)
        # Names in expressions have been found; the rest keeps its offsets.
        text = _EXPRESSION.sub(lambda each: "0" * len(each[0]), text)
        for dotted in _DOTTED.finditer(text):
            self._path(owner, node, dotted.start(), dotted[0])
        section = key.partition(".")[0]
        if section == "connections" or (section == "aspects" and key.endswith(".at")):
            for word in _HEAD.finditer(text):
                kind = "port" if section == "connections" else "actor"
                self._use([self.name_of(owner, kind, word[1])], _part_of(node, word.start(1), word[1]))
        elif key == "metrics.from":
            for word in _WORD.finditer(text):
                self._use([self.name_of(owner, "metric", word[1])], _part_of(node, word.start(1), word[1]))

    def _path(self, owner: str, node: Scalar, start: int, path: str) -> None:
        """The names along a dotted path or pattern, as far as it is one."""
        classes, offset, found = {owner}, start, list[tuple[set[Name | None], int, str]]()
        segments = path.split(".")
        for number, segment in enumerate(segments):
            name = segment.partition("[")[0]
            if name == "**":
                classes = self._all_inside(classes)
            elif name == "*":
                classes = {inner for each in classes for inner in self._insides(each)}
            else:
                is_last = number == len(segments) - 1
                kinds = ("port", "parameter", "actor") if is_last and number else ("actor", "aspect")
                named = {self.name_of(each, kind, name) for each in classes for kind in kinds} - {None}
                if not named and not number:
                    return  # it is something else
                found.append((named, offset, name))
                classes = {inner for each in classes for inner in self.inner(each, name)}
            offset += len(segment) + 1
        for named, at, name in found:
            self._use(named, _part_of(node, at, name))

    def actors(self, owner: str) -> list[str]:
        """The names of the actors of a class, with those of its bases."""
        return list(self.declared(owner, "actor"))

    def _insides(self, owner: str) -> set[str]:
        """The composite classes of all actors of a class."""
        return {inner for actor in self.actors(owner) for inner in self.inner(owner, actor)}

    def _all_inside(self, classes: set[str]) -> set[str]:
        found, waiting = set(classes), list(classes)
        while waiting:
            owner = waiting.pop()
            new = self._insides(owner) - found
            found |= new
            waiting += new
        return found


def _entry(node: Node, key: str) -> Entry | None:
    return node.entries.get(key) if isinstance(node, MappingNode) else None


def _scalars(node: Node) -> list[Scalar]:
    """The texts of a list, a mapping, or a single one."""
    if isinstance(node, Scalar):
        return [node]
    items = node.items if isinstance(node, Sequence) else [each.value for each in node.entries.values()]
    return [each for each in items if isinstance(each, Scalar)]


def _whole(node: Scalar) -> Position | None:
    return _part_of(node, 0, node.text)


def _part_of(node: Scalar, offset: int, part: str) -> Position | None:
    """The position of a part of a text; None if the file writes it in another way."""
    at = inside(node, node.text, offset, part)
    start = at.column - 1
    if at.source[start : start + at.length] == part:
        return at
    # A text over several lines: the part is on one of them, if its line is that of the position.
    return replace(at, length=len(part)) if at.source[start : start + len(part)] == part else None
