"""YAML text -> nodes with positions: the first step from a model file to a graph.

The language is YAML 1.2 with the core schema and no surprises: no tags that build objects, no merge keys, no duplicate
keys, only text as keys.  Problems are noted, not raised, so that one run shows all of them.
"""

import dataclasses
import itertools
import re
from pathlib import Path
from typing import Final, NoReturn

import yaml
from yaml.events import (
    AliasEvent,
    CollectionEndEvent,
    CollectionStartEvent,
    DocumentStartEvent,
    Event,
    MappingStartEvent,
    ScalarEvent,
)

from epicycle.actors import MAX_DEPTH, did_you_mean, irregular, open_regular

from .files import Opened, note_file, opened_text, present
from .frames import Frame
from .kinds import FILE, KEY, SIZE, SYNTAX, Kind
from .nodes import Entry, Mapping, Node, Scalar, Sequence, plain
from .problems import Position, Problems
from .scalars import SCALAR_TAGS, TAG_PREFIX, Value, resolve, short

__all__ = ["Entry", "Mapping", "Node", "Scalar", "Sequence", "plain"]  # of nodes.py

MAX_BYTES = 10_000_000
MAX_NODES = 200_000  # counting each alias as often as it is used

LOADER: type[yaml.CSafeLoader] | type[yaml.SafeLoader] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def read(path: Path, problems: Problems, shown_as: str | None = None) -> Node | None:
    """Read a YAML file; None if it cannot be parsed. `shown_as` is its name in messages."""
    name = str(path) if shown_as is None else shown_as
    if (text := opened_text(path)) is None:
        with problems.looking_for(FILE):
            text = _text_of(path, name, problems)
    if text is None:
        return None
    if (opened := present()) is None:
        return parse(text, name, problems)
    opened.read[name] = (path, text)
    return parse_once(text, name, problems, opened)


def parse_once(text: str, name: str, problems: Problems, opened: Opened) -> Node | None:
    """As ``parse``, unless it is the latest text of that name, and had no problems."""
    found: Node | None
    known, found = opened.parsed.get(name, ("", None))
    if known != text or found is None:
        before = len(problems)
        found = parse(text, name, problems)
        if len(problems) == before:
            opened.parsed[name] = text, found
    return found


def _text_of(path: Path, name: str, problems: Problems) -> str | None:
    """What a file holds; None, and a problem, if it cannot be read."""
    try:
        if not path.exists():
            _add_missing(path, name, problems)
            return None
        if kind := irregular(path):
            problems.add(f"{name} is {kind}")
            return None
        with open_regular(path) as file:
            data = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the path
        problems.add(f"cannot read {name}: {getattr(error, 'strerror', None) or error}")
        return None
    if len(data) > MAX_BYTES:
        problems.add(_too_large(name), kind=SIZE)
        return None
    note_file(path, data)
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        _add_undecodable(data, error.start, name, problems)
        return None


def parse(text: str, name: str, problems: Problems, shown_as: str | None = None) -> Node | None:
    """Turn YAML text into nodes; None if it cannot be parsed.

    `name` is the file in messages, `shown_as` the line that contains a text of one line.
    """
    if len(text) > MAX_BYTES:
        problems.add(_too_large(name), kind=SIZE)
        return None
    with problems.looking_for(SYNTAX):
        return _Builder(text.removeprefix("\ufeff"), name, problems, shown_as).build()


def _too_large(name: str) -> str:
    return f"{name} is larger than {MAX_BYTES // 1_000_000} MB"


def _add_missing(path: Path, name: str, problems: Problems) -> None:
    folder = path.parent
    if not folder.is_dir():
        problems.add(f"there is no file {name}: there is no folder {folder}")
        return
    names = [entry.name for entry in itertools.islice(folder.iterdir(), 10_000)]
    problems.add(f"there is no file {name}", near=(path.name, names))


def _add_undecodable(data: bytes, offset: int, name: str, problems: Problems) -> None:
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        problems.add(f"{name} is UTF-16, not UTF-8 text: save it as UTF-8")
        return
    before = data[:offset].decode("utf-8")  # valid, as the first bad byte is at the offset
    rest = data[offset:].split(b"\n", 1)[0].decode("utf-8", "backslashreplace")
    lines = LINE_BREAK.split(before)
    position = Position(name, len(lines), len(lines[-1]) + 1, 4, lines[-1] + rest.rstrip("\r"))
    message = f"this is not UTF-8 text: it has the byte 0x{data[offset]:02x}"
    problems.add(message, position, "save the file as UTF-8")


# --- the builder --------------------------------------------------------------------------------------

# libyaml counts lines this way; ours must agree with its marks.
LINE_BREAK = re.compile("\r\n|[\n\r\x85\u2028\u2029]")
_CONTROL = re.compile("[^\t\n\r\x20-\x7e]")  # of an ASCII text
_UNPRINTABLE = "[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufefe\uff00-\ufffd\U00010000-\U0010ffff]"
_BEGINNING = 50_000  # characters of a broken text that are read again by the slow parser, in a second at most
_SCALAR = "scalar"  # the scope of a problem with a value as such: others at its place would be consequences
_INDEXED = re.compile(r"\w\[(?:\d+|\*)\]")
_OPENED = re.compile(r"\w\[$")
_ARROW = re.compile(r"\s*[-=]>")
_BRACKET = re.compile(r"[\[\]{}]")
_PROPERTIES = re.compile(r"(?:[&!]\S*[ \t]+)+")

_HELP_FOR_SYNTAX: Final = (
    ("mapping values are not allowed", "check the indentation, and quote a text that contains ': '"),
    ("did not find expected ',' or", "a bracket is not closed, or a comma is missing"),
    ("found unexpected end of stream", "a quote is not closed"),
    ("did not find expected key", "check the indentation, and that brackets and quotes are closed"),
    ("did not find expected alphabetic", "quote a text that contains [*] or *"),
    ("did not find expected '-' indicator", "check the indentation: align all '-' of a list in one column"),
    ("could not find expected ':'", "each key needs a ':' and a space after it"),
    ("did not find expected node content", "a bracket is not closed, or a value is missing"),
)


class _StopError(Exception):
    """The file cannot be read any further; the reason has been noted."""


class _Builder:
    """Builds nodes from parser events with a stack of its own, so that no depth can overflow Python's."""

    def __init__(self, text: str, name: str, problems: Problems, shown_as: str | None) -> None:
        self._text = text
        self._name = name
        self._problems = problems
        self._lines = LINE_BREAK.split(text) if shown_as is None else [shown_as]
        self._stack: list[Frame] = []
        self._root: Node | None = None
        self._anchors: dict[str, tuple[Node, int, int] | None] = {}  # None: still open
        self._nodes = 0

    def build(self) -> Node | None:
        # Few texts need the second, which is slow to compile.
        if found := (_CONTROL.search(self._text) if self._text.isascii() else re.search(_UNPRINTABLE, self._text)):
            before = LINE_BREAK.split(self._text[: found.start()])
            at = self._at(len(before) - 1, len(before[-1]))
            message = f"YAML does not allow the character U+{ord(found[0]):04X}"
            self._problems.add(message, at, 'write it as an escape in "..."')
            return None
        try:
            for event in yaml.parse(self._text, Loader=LOADER):
                self._take(event)
        except yaml.MarkedYAMLError as error:
            if not (self._may_be_deep() and self._is_too_deep()):
                self._add_syntax(error)
            return None
        except yaml.YAMLError as error:
            self._problems.add(f"{self._name}: broken YAML: {error}")
            return None
        except _StopError:
            return None
        root = self._root
        if root is None or (isinstance(root, Scalar) and root.plain and not root.text):
            self._problems.add(f"{self._name} is empty")
            return None
        return root

    def _may_be_deep(self) -> bool:
        """Whether so many brackets are open somewhere; those in quotes and comments count, too."""
        depth = 0
        for bracket in _BRACKET.finditer(self._text, 0, _BEGINNING):
            depth += 1 if bracket[0] in "[{" else -1 if depth else 0
            if depth > MAX_DEPTH:
                return True
        return False

    def _is_too_deep(self) -> bool:
        """Report nesting that libyaml itself refuses, which newer versions do before they give us any event."""
        depth = 0
        try:
            for event in yaml.parse(self._text[:_BEGINNING], Loader=yaml.SafeLoader):
                depth += isinstance(event, CollectionStartEvent) - isinstance(event, CollectionEndEvent)
                if depth > MAX_DEPTH:
                    self._problems.add(f"nested deeper than {MAX_DEPTH} levels", self._span(event), kind=SIZE)
                    return True
        except yaml.YAMLError:
            pass
        return False

    def _take(self, event: Event) -> None:
        if isinstance(event, ScalarEvent):
            node = self._scalar(event)
            self._count(1, node.position)
            self._add(node, 1, 0, event.anchor)
        elif isinstance(event, CollectionStartEvent):
            self._open(event)
        elif isinstance(event, CollectionEndEvent):
            self._close(event)
        elif isinstance(event, AliasEvent):
            self._alias(event)
        elif isinstance(event, DocumentStartEvent) and self._root is not None:
            self._stop("a second YAML document starts here: one file holds one model", self._span(event))

    # --- nodes

    def _add(self, node: Node, weight: int, height: int, anchor: str | None = None) -> None:
        """Add a finished node to the open list or mapping."""
        if anchor is not None:
            self._anchors[anchor] = (node, weight, height)
        if not self._stack:
            self._root = node
            return
        frame = self._stack[-1]
        frame.weight += weight
        if height >= frame.height:
            frame.height = height + 1
        if not frame.is_mapping:
            if (rest := frame.rest_of(node)) is not None:
                frame.join(rest)
            else:
                frame.items.append(node)
        elif not frame.has_key:
            frame.has_key = True
            frame.rest = frame.rest_of(node)
            frame.key = self._checked_key(frame, node) if frame.rest is None else None
        else:
            frame.has_key = False
            if frame.rest is not None:
                if isinstance(node, Scalar) and node.plain and not node.text:
                    frame.join(frame.rest)
                    return
                frame.key = self._checked_key(frame, frame.rest)
            if frame.key is not None:
                frame.entries[frame.key.text] = Entry(frame.key, node)

    def _open(self, event: CollectionStartEvent) -> None:
        position = self._span(event)
        is_mapping = isinstance(event, MappingStartEvent)
        self._count(1, position)
        if len(self._stack) >= MAX_DEPTH:
            self._stop(f"nested deeper than {MAX_DEPTH} levels", position, SIZE)
        expected, kind = ("map", "mapping") if is_mapping else ("seq", "list")
        if event.tag is not None and event.tag != TAG_PREFIX + expected:
            self._add_tag(event.tag, f"a {kind}", self._span(event, with_properties=True))
        if event.anchor is not None:
            self._anchors[event.anchor] = None
        self._stack.append(Frame(event, position, is_mapping))

    def _close(self, event: CollectionEndEvent) -> None:
        frame = self._stack.pop()
        frame.report(self._problems)
        position = self._collection_position(frame, event)
        node: Node
        if frame.is_mapping:
            node = Mapping(frame.entries, position)
        else:
            node = Sequence(tuple(frame.items), position)
        self._add(node, frame.weight, frame.height, frame.event.anchor)

    def _alias(self, event: AliasEvent) -> None:
        position = self._span(event)
        name = event.anchor or ""
        if name not in self._anchors:
            guess = did_you_mean(name, self._anchors)
            self._stop(f"there is no anchor &{name} before this alias{guess}", position)
        known = self._anchors[name]
        if known is None:
            self._stop(f"the alias *{name} is inside &{name} itself", position)
        node, weight, height = known
        self._count(weight, position)
        if len(self._stack) + height > MAX_DEPTH:
            self._stop(f"nested deeper than {MAX_DEPTH} levels by the alias *{name}", position, SIZE)
        # Problems of the node itself are reported where it is used, those inside it where it is written.
        self._add(dataclasses.replace(node, position=position), weight, height)

    def _scalar(self, event: ScalarEvent) -> Scalar:
        position = self._span(event)
        text = event.value
        is_plain = not event.style
        value: Value = text
        try:
            if event.tag is not None:
                value = self._tagged(event.tag, text, self._span(event, with_properties=True))
            elif is_plain:
                value = resolve(text)
        except ValueError as error:
            self._problems.add(str(error), position, scope=_SCALAR)
        return Scalar(value, text, is_plain, position)

    def _tagged(self, tag: str, text: str, position: Position) -> Value:
        kind = tag.removeprefix(TAG_PREFIX)
        if tag == TAG_PREFIX + "str":
            return text
        if kind == tag or kind not in SCALAR_TAGS:
            self._add_tag(tag, "a single value", position)
            return text
        value = resolve(text)
        if type(value) not in SCALAR_TAGS[kind]:
            raise ValueError(f"!!{kind} does not fit {short(text)!r}")
        return float(value) if kind == "float" and isinstance(value, int) else value

    def _checked_key(self, frame: Frame, key: Node) -> Scalar | None:
        """Return the key if it is valid; otherwise report why not."""
        at = key.position
        if not isinstance(key, Scalar):
            kind = "mapping" if isinstance(key, Mapping) else "list"
            hint = "quote a text that starts with '{' or '['"
            self._problems.add(f"a key must be text, but this one is a {kind}", at, hint, kind=KEY)
        elif not isinstance(key.value, str):
            shown = short(key.text)
            kind = shown if key.text else "empty"
            self._problems.add(f"a key must be text, but this one is {kind}", at, f"quote it: '{shown}'", kind=KEY)
        elif key.value == "<<" and key.plain:
            hint = "write the entries out, or use a composite class"
            self._problems.add("YAML 1.2 has no merge keys (<<)", at, hint, kind=KEY)
        elif key.value in frame.entries:
            first = frame.entries[key.value].key.position.line
            message = f"duplicate key {short(key.value)!r}: first on line {first}, again on line {at.line}"
            self._problems.add(message, at, kind=KEY)
        else:
            return key
        return None

    # --- positions

    def _at(self, line: int, column: int, length: int = 1) -> Position:
        source = self._lines[line] if line < len(self._lines) else ""
        return Position(self._name, line + 1, column + 1, max(length, 1), source)

    def _span(self, event: Event, *, with_properties: bool = False) -> Position:
        """Return the position of an event: its first line only, and without anchor and tag unless asked."""
        start, end = event.start_mark, event.end_mark
        assert start is not None
        assert end is not None
        line, column = start.line, start.column
        source = self._lines[line] if line < len(self._lines) else ""
        stop = end.column if end.line == line else len(source)
        if isinstance(event, (ScalarEvent, CollectionStartEvent)) and (event.anchor or event.tag):
            found = _PROPERTIES.match(source, column)
            if found is not None and with_properties:
                stop = column + len(found[0].rstrip())
            elif found is not None and found.end() < stop:
                column = found.end()
        return Position(self._name, line + 1, column + 1, max(stop - column, 1), source)

    def _collection_position(self, frame: Frame, end: CollectionEndEvent) -> Position:
        """Return the position of a whole list or mapping: its brackets, or else its first key or dash."""
        at = frame.position
        if not frame.event.flow_style:
            first = next(iter(frame.entries.values())).key.position if frame.entries else None
            if first is not None and first.line >= at.line:
                return first
            return dataclasses.replace(at, length=1)
        mark = end.end_mark
        assert mark is not None
        stop = mark.column if mark.line + 1 == at.line else len(at.source)
        return dataclasses.replace(at, length=max(stop - at.column + 1, 1))

    # --- problems

    def _count(self, nodes: int, position: Position) -> None:
        self._nodes += nodes
        if self._nodes > MAX_NODES:
            self._stop(f"more than {MAX_NODES:,} values, aliases counted at each use", position, SIZE)

    def _stop(self, message: str, position: Position, kind: Kind = SYNTAX) -> NoReturn:
        self._problems.add(message, position, kind=kind)
        raise _StopError

    def _add_tag(self, tag: str, kind: str, position: Position) -> None:
        shown = short("!!" + tag.removeprefix(TAG_PREFIX) if tag.startswith(TAG_PREFIX) else tag)
        known = shown.removeprefix("!!") in {"str", "map", "seq", *SCALAR_TAGS} and shown.startswith("!!")
        reason = f"does not fit {kind}" if known else "is not allowed"
        self._problems.add(f"the tag {shown} {reason}", position, "leave it out, or quote a text that starts with '!'")

    def _add_syntax(self, error: yaml.MarkedYAMLError) -> None:
        message = error.problem or str(error)
        hints = [hint for start, hint in _HELP_FOR_SYNTAX if message.startswith(start)]
        context = error.context_mark
        mark = error.problem_mark or context
        if context is not None and mark is not None and not "".join(self._lines[mark.line :]).strip():
            mark = context  # what is missing at the end of the file is reported where it begins
        position = None if mark is None else self._at(mark.line, mark.column)
        before = "" if position is None else position.source[: position.column]  # where it breaks off
        if message.startswith("did not find expected ','") and before.endswith("${"):
            hints = ['within { } and [ ], quote an expression: "${...}"']
        elif position is not None and hints and _ARROW.match(position.source, position.column - 1):
            hints = ["write the ports on the left without brackets, or quote the whole connection"]
        elif position is not None and hints and (_INDEXED.search(position.source) or _OPENED.search(before)):
            hints.append('within { } and [ ], quote a text with an index: "a[0].port"')
        if position is not None and message.startswith("found character"):
            character = position.source[position.column - 1 : position.column]
            quote = f"quote a text that starts with {character!r}"
            hints = ["indent with spaces, not tabs" if character == "\t" else quote]
        if error.context and context is not None and mark is not None and context.line != mark.line:
            hints.insert(0, f"{error.context} that starts on line {context.line + 1}")
        self._problems.add(f"broken YAML: {message}", position, *hints)
