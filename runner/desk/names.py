"""The names of a model in its texts: where each is declared, and where it is used."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

from epicycle.actors.expression import ExpressionError, names_in

from ..model.text.document import Entry, Scalar
from ..model.text.document import Mapping as MappingNode
from ..model.text.problems import Position
from ..model.text.reading import inside
from .places import Keys, scalars, text_of, value_of, walk
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
_NO_NAMES = ("composites", "doc", "model", "include", "extends")  # keys of a class, without paths and expressions
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


class Names:
    """All names in the files of a model."""

    def __init__(self, reading: Reading) -> None:
        self.classes: dict[str, list[MappingNode]] = defaultdict(list)  # what declares each, in one file or several
        for node in reading.nodes.values():
            if isinstance(node, MappingNode):
                for name, entry in declared_in(node, "composites").items():
                    if isinstance(entry.value, MappingNode):
                        self.classes[name].append(entry.value)
                self.classes[MODEL].append(node)
        # By class, and by section as well as by kind.
        self._declared: dict[tuple[str, str], dict[str, Entry]] = defaultdict(dict)
        for owner, mappings in self.classes.items():
            for section, kind in SECTIONS.items():
                for name, entry in [each for mapping in mappings for each in declared_in(mapping, section).items()]:
                    self._declared[owner, section].setdefault(name, entry)
                    self._declared[owner, kind].setdefault(name, entry)

    @cached_property
    def uses(self) -> list[Use]:
        """Where names stand; found when somebody asks, which takes longer than to read what is declared."""
        return [use for owner, mappings in self.classes.items() for each in mappings for use in self._used(owner, each)]

    # -- what is declared -----------------------------------------------------------------------------------------

    def bases(self, owner: str) -> list[str]:
        """A class and those that it extends, the first one last."""
        found = [owner]
        while owner and (base := self.said(owner, "extends")) and base in self.classes and base not in found:
            found.append(owner := base)
        return found

    def said(self, owner: str, key: str) -> str:
        """The text that a class has under a key."""
        return next((said for each in self.classes[owner] if (said := text_of(each, key))), "")

    def declared(self, owner: str, what: str) -> Mapping[str, Entry]:
        """What a class and its bases declare of a kind, or in a section, by name."""
        found: dict[str, Entry] = {}
        for each in reversed(self.bases(owner)):
            found |= self._declared[each, what]
        return found

    def _declaring(self, owner: str, kind: str, name: str) -> list[str]:
        """The classes, this one and its bases, that declare a name; its own declaration comes first."""
        return [each for each in self.bases(owner) if name in self._declared[each, kind]]

    def name_of(self, owner: str, kind: str, name: str) -> Name | None:
        """What a name means in a class."""
        found = self._declaring(owner, kind, name)
        return Name(kind, found[-1], name) if found else None

    def entry(self, owner: str, kind: str, name: str) -> Entry | None:
        """Where a name is declared that a class has."""
        return next((self._declared[each, kind][name] for each in self._declaring(owner, kind, name)), None)

    def types_of(self, owner: str, part: str, *kinds: str) -> list[str]:
        """The types that an actor, an aspect, or a part of other kinds may have; a parameter may choose one."""
        entries = [
            self._declared[each, kind][part]
            for kind in kinds or ("actor", "aspect")
            for each in self._declaring(owner, kind, part)
        ]
        said = next((said for each in entries if (said := text_of(each.value, "type").strip())), "")
        if not said.startswith("${"):
            return [said] if said else []
        chooser = self.entry(owner, "parameter", said.strip("${ }"))
        choices = value_of(chooser.value, "choices") if chooser is not None else None
        return [each.text for each in scalars(choices)]

    def inner(self, owner: str, actor: str) -> list[str]:
        """The composite classes that an actor of a class may be."""
        return [each for each in self.types_of(owner, actor) if each in self.classes and each]

    # -- what is used ---------------------------------------------------------------------------------------------

    def of(self, name: Name) -> list[Use]:
        """Where a name stands."""
        return [use for use in self.uses if name in use.names]

    def _used(self, owner: str, mapping: MappingNode) -> Iterator[Use]:
        """The names in a mapping that declares a class."""
        for keys, is_key, node, around, _ in walk(mapping):
            owners, kind, declares = list[str](), "", False
            match (is_key, *keys):
                case (True, str(section)) if section in SECTIONS and (owner == MODEL or section != "composites"):
                    owners, kind, declares = [owner], SECTIONS[section], True
                case (False, "inputs" | "outputs") | (False, "inputs" | "outputs", int()):
                    owners, kind, declares = [owner], "port", True
                case (True, "actors" | "aspects", name):
                    owners, kind = self.inner(owner, str(name)), "parameter"
                case (False, "actors" | "aspects", name, "inherit", *_):
                    owners, kind = [owner, *self.inner(owner, str(name))], "parameter"
                case (
                    (False, "actors" | "aspects", _, "type")
                    | (False, "aspects", _, "at", *_, "type")
                    | (False, "parameters", _, "choices", *_)
                ):
                    owners, kind = [MODEL], "composite"
                case (False, "aspects", _, "at", *_, "port"):
                    owners, kind = [text_of(around[-1], "type")], "port"
                case (False, "extends") if owner != MODEL:
                    owners, kind = [MODEL], "composite"
            yield from self._use(owners, [kind], node, 0, node.text, declares)
            if not is_key and keys and keys[0] not in _NO_NAMES:
                yield from self._used_in_text(owner, node, keys)

    def _use(
        self, owners: Iterable[str], kinds: Iterable[str], node: Scalar, start: int, name: str, declares: bool = False
    ) -> Iterator[Use]:
        """What a name means at a place in a text, as one of some kinds in one of some classes."""
        found = {self.name_of(owner, kind, name) for owner in owners for kind in kinds} - {None}
        if found and (at := _part_of(node, start, name)) is not None:
            yield Use(frozenset(filter(None, found)), at, declares)

    def _used_in_text(self, owner: str, node: Scalar, keys: Keys) -> Iterator[Use]:
        text, section = node.text, keys[0]
        rule = next((key for key in reversed(keys) if key in _OWN_RULES), "")
        for found in _EXPRESSION.finditer(text):
            try:
                asked = names_in(found[0])
            except ExpressionError:
                continue
            for word in re.finditer(r"(?<![\w.])[A-Za-z_]\w*", found[0]):
                if word[0] in asked:
                    yield from self._use([owner], ["parameter"], node, found.start() + word.start(), word[0])
        # Names in expressions have been found; the rest keeps its offsets.
        text = _EXPRESSION.sub(lambda each: "0" * len(each[0]), text)
        for dotted in _DOTTED.finditer(text):
            yield from self._path(owner, node, dotted.start(), dotted[0])
        words, kind = _HEAD, "port" if section == "connections" else "actor"
        if section == "metrics" and rule == "from":
            words, kind = _WORD, "metric"
        elif section != "connections" and (section, rule) != ("aspects", "at"):
            return
        for word in words.finditer(text):
            yield from self._use([owner], [kind], node, word.start(1), word[1])

    def _path(self, owner: str, node: Scalar, start: int, path: str) -> Iterator[Use]:
        """The names along a dotted path or pattern, as far as it is one."""
        classes = {owner}
        segments = path.split(".")
        for number, segment in enumerate(segments):
            name = segment.partition("[")[0]
            if name == "**":
                while not (inside := self._insides(classes)) <= classes:
                    classes = classes | inside
            elif name == "*":
                classes = self._insides(classes)
            else:
                is_last = 0 < number == len(segments) - 1
                kinds = ("port", "parameter", "actor") if is_last else ("actor", "aspect")
                used = [*self._use(classes, kinds, node, start, name)]
                if not used and not number:
                    return  # it is something else
                yield from used
                classes = {inner for each in classes for inner in self.inner(each, name)}
            start += len(segment) + 1

    def _insides(self, classes: Iterable[str]) -> set[str]:
        """The composite classes of all actors of some classes."""
        return {kind for each in classes for actor in self.declared(each, "actor") for kind in self.inner(each, actor)}


def declared_in(
    mapping: MappingNode, section: str, listed: Iterable[str] = ("inputs", "outputs")
) -> Mapping[str, Entry]:
    """What a section declares, by name; some may be a list of names."""
    node = value_of(mapping, section)
    if isinstance(node, MappingNode):
        return node.entries
    return {each.text: Entry(each, each) for each in scalars(node) if each.text and section in listed}


def _part_of(node: Scalar, offset: int, part: str) -> Position | None:
    """The position of a part of a text; None if the file writes it in another way."""
    at = inside(node, node.text, offset, part)
    start = at.column - 1
    if at.source[start : start + at.length] == part:
        return at
    # A text over several lines: the part is on one of them, if its line is that of the position.
    return replace(at, length=len(part)) if at.source[start : start + len(part)] == part else None
