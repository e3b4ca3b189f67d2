"""The parts of a text, with their ends, and how one is written, added or deleted in place: all else stays as it is.

The nodes of ``text/document.py`` know where they begin; a change must also know where they end.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import yaml
from yaml.events import AliasEvent, CollectionEndEvent, CollectionStartEvent, MappingStartEvent, ScalarEvent

from epicycle.actors import EpicycleError

from ..model.text.document import Scalar, parse, plain
from ..model.text.document import Sequence as ListNode
from ..model.text.problems import Problems
from ..model.text.scalars import resolve

Keys = tuple[str | int, ...]
SECTIONS = ("actors", "connections", "aspects")  # that go with their last entry
_LOADER: type[yaml.CSafeLoader] | type[yaml.SafeLoader] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_PLAIN = re.compile(r"[A-Za-z0-9_.+*/^%°$(<>=-][A-Za-z0-9_.+*/^%°$()<>= -]*\Z")
_PLAIN_ITEM = re.compile(
    r"[A-Za-z_][\w.\[\]*, ]* [=-]> [\w.\[\]*, ]*\w\Z", re.ASCII
)  # a connection, outside of brackets
_COMMENT = re.compile(r"(?<!\S)#[^\n]*")
_BREAKS = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029\ufeff]")


class EditError(EpicycleError):
    """A change that cannot be made in this text."""


@dataclass
class Part:
    """A stretch of a text: a scalar, an alias, or a collection with what it holds."""

    kind: str  # scalar, alias, mapping or list
    start: int
    end: int = 0
    is_flow: bool = False
    keys: list[Part] = field(default_factory=list)
    items: list[Part] = field(default_factory=list)
    text: str = ""

    def find(self, key: str | int) -> int:
        """The number of a key's value among the items; -1 if there is none."""
        if self.kind == "list" and isinstance(key, int):
            return key if key < len(self.items) else -1
        return next((number for number, each in enumerate(self.keys) if each.text == key), -1)

    def begin(self, text: str, number: int) -> int:
        """Where an item begins, with its key or its dash."""
        start = (self.keys or self.items)[number].start
        return text.rfind("-", 0, start) if self.kind == "list" and not self.is_flow else start


def data_of(text: str) -> Any:
    """What a text holds, as plain data; raises ``EditError`` if it cannot be read."""
    if not _COMMENT.sub("", text).strip("\ufeff \t\r\n"):
        return None
    problems = Problems()
    node = parse(text, "the text", problems)
    if problems.found:
        raise EditError(f"this can be changed once the text can be read: {problems.found[0].message}")
    return None if node is None else plain(node)


def parts_of(text: str) -> Part | None:
    """The outermost part of a text that can be read; None if it is empty."""
    mark = text.startswith("\ufeff")
    body = text[mark:]
    stack: list[Part] = []
    root: Part | None = None
    for event in yaml.parse(body, Loader=_LOADER):
        if isinstance(event, CollectionEndEvent):
            made = stack.pop()
            inner = [*made.keys, *made.items]
            made.end = _index(event.end_mark) + mark if made.is_flow else max(each.end for each in inner)
            continue
        if not isinstance(event, (ScalarEvent, AliasEvent, CollectionStartEvent)):
            continue
        start, end = _index(event.start_mark) + mark, _index(event.end_mark) + mark
        if isinstance(event, CollectionStartEvent):
            made = Part("mapping" if isinstance(event, MappingStartEvent) else "list", start)
            made.is_flow = bool(event.flow_style)
        else:
            end = start + len(text[start:end].rstrip())
            made = Part("alias" if isinstance(event, AliasEvent) else "scalar", start, end)
            made.text = event.value if isinstance(event, ScalarEvent) else ""
        if not stack:
            root = root or made
        elif stack[-1].kind == "mapping" and len(stack[-1].keys) == len(stack[-1].items):
            stack[-1].keys.append(made)
        else:
            stack[-1].items.append(made)
        if isinstance(event, CollectionStartEvent):
            stack.append(made)
    return root


def _index(mark: Any) -> int:
    found: int = mark.index
    return found


def along(text: str, keys: Keys) -> list[Part]:
    """The parts that some keys lead through, as far as there are any; the outermost one first."""
    root = parts_of(text)
    found = [] if root is None else [root]
    for key in keys if found else ():
        number = found[-1].find(key)
        if number < 0:
            break
        found.append(found[-1].items[number])
    return found


# -- values -----------------------------------------------------------------------------------------------------------


def quoted(value: str) -> str:
    """A text in quotes, whatever it holds."""
    if any("\ud800" <= each <= "\udfff" for each in value):
        raise EditError("a text cannot hold half of a character")
    return _BREAKS.sub(lambda found: f"\\u{ord(found[0]):04x}", json.dumps(value, ensure_ascii=False))


def written(value: Any) -> str:
    """A value as a file writes it on one line, within brackets or not."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{written(key)}: {written(each)}" for key, each in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(written, value)) + "]"
    if not isinstance(value, str):
        return json.dumps(value)
    is_plain = _PLAIN.match(value) and not re.search(r"\s\Z|---|\A[-*%=>] |\A[*%>=]|\A-\Z", value)
    return value if is_plain and resolve(value) == value else quoted(value)


def typed(said: str) -> str:
    """What somebody typed as a value: as it is, if it is one value, otherwise as text."""
    said = said.strip()
    if said and said[0] not in "&*!" and _BREAKS.search(said) is None and _COMMENT.search(said) is None:
        problems = Problems()
        node = parse(f"[{said}]", "", problems)
        items = node.items if isinstance(node, ListNode) else ()
        if not problems.found and len(items) == 1 and (said[0] in "[{\"'" or isinstance(items[0], Scalar)):
            return said
    return quoted(said)


# -- changes ----------------------------------------------------------------------------------------------------------


def put(text: str, keys: Keys, value: str) -> str:
    """The text with a value, as it is written on one line, in place of another."""
    found = along(text, keys)
    if len(found) <= len(keys):
        raise EditError(f"there is no {path(keys)} in this text")
    part = found[-1]
    if part.kind == "alias":
        raise EditError(f"{path(keys)} is an alias: change it by hand")
    if part.start == part.end:  # a key without a value, perhaps without a colon
        key = found[-2].keys[found[-2].find(keys[-1])]
        colon = text.find(":", key.end, part.start + 1)
        at = key.end if colon < 0 else colon + 1
        return f"{text[:at]}{': ' if colon < 0 else ' '}{value}{text[at:]}"
    return text[: part.start] + value + text[part.end :]


def add(text: str, keys: Keys, key: str | None, value: Any, order: Sequence[str] = ()) -> str:
    """The text with another entry in the mapping under some keys, or another item in the list, if ``key`` is None.

    It comes behind the others, or, by ``order``, behind the keys before it.  The collection is made if it is missing.
    """
    found = along(text, keys)
    if len(found) <= len(keys) or _is_empty(found[-1]):
        return _begin(text, keys, key, value, order, is_there=len(found) > len(keys))
    part, line = found[-1], _break(text)
    if part.kind != ("list" if key is None else "mapping"):
        raise EditError(f"{path(keys)} is no {'list' if key is None else 'mapping'}: change it by hand")
    if part.is_flow:
        entry = _entry(key, value)
        if not part.items:
            return f"{text[: part.end - 1]}{entry}{text[part.end - 1 :]}"
        end, begin = _end(part, -1), part.begin(text, len(part.items) - 1)
        indent = text[_line_start(text, begin) : begin]
        if indent.strip():
            return f"{text[:end]}, {entry}{text[end:]}"
        following = _line_end(text, end) if "#" in text[end : _line_end(text, end)] else end
        return f"{text[:end]},{text[end:following]}{line}{indent}{entry}{text[following:]}"
    begin = part.begin(text, 0)
    indent = " " * (begin - _line_start(text, begin))
    names, before = [each.text for each in part.keys], len(part.items)
    if key in order:
        earlier = order[: order.index(key) + 1]
        before = 1 + max((number for number, name in enumerate(names) if name in earlier), default=-1)
    entry = _block(key, value, indent, line)
    if before == 0:
        return f"{text[:begin]}{entry}{line}{indent}{text[begin:]}"
    if keys == () and _has_gaps(text, part):
        indent = line + indent
    end = _line_end(text, part.items[before - 1].end)
    return f"{text[:end]}{line}{indent}{entry}{text[end:]}"


def _begin(text: str, keys: Keys, key: str | None, value: Any, order: Sequence[str], *, is_there: bool) -> str:
    """The text with the first entry of a collection that is missing or empty."""
    first = [value] if key is None else {key: value}
    if not keys:
        before = text if not text or text.endswith("\n") else text + _break(text)
        return f"{before}{_block(key, value, '', _break(text))}{_break(text)}"
    around = along(text, keys[:-1])[-1:]
    if is_there and around and around[0].is_flow:
        return put(text, keys, written(first))
    if not is_there:
        return add(text, keys[:-1], str(keys[-1]), first, order)
    key_part = around[0].keys[around[0].find(keys[-1])]
    start = _line_start(text, key_part.start)
    indent, line = " " * (key_part.start - start + 2), _break(text)
    end = _line_end(text, key_part.end)
    return f"{text[:end]}{line}{indent}{_block(key, value, indent, line)}{text[end:]}"


def delete(text: str, keys: Keys) -> str:
    """The text without an entry or item, and the comment behind it; without its collection, if that would be empty."""
    found = along(text, keys)
    if len(found) <= len(keys) or not keys:
        raise EditError(f"there is no {path(keys)} in this text")
    part, number = found[-2], found[-2].find(keys[-1])
    if len(part.items) == 1 and len(keys) > 1:
        return (
            delete(text, keys[:-1])
            if keys[-2] in SECTIONS
            else put(text, keys[:-1], "[]" if part.kind == "list" else "{}")
        )
    begin, end = (
        part.begin(text, number),
        _end(part, number),
    )
    if not part.is_flow:
        start = _line_start(text, begin)
        if text[start:begin].strip():  # behind the dash of a list
            return text[:begin] + text[part.begin(text, number + 1) :]
        return text[:start] + text[_line_end(text, end) :].removeprefix("\r").removeprefix("\n")
    if number + 1 < len(part.items):  # with the comma behind it
        following = part.begin(text, number + 1)
        comma = _comma(text, end, following)
        between = text[comma + 1 : following]
        return text[:begin] + (text[following:] if not between.strip() else text[comma + 1 :].lstrip(" "))
    if number:  # with the comma before it
        before = _end(part, number - 1)
        comma = _comma(text, before, begin)
        between = text[comma + 1 : begin]
        return text[:comma] + ("" if not between.strip() else between.rstrip(" ")) + text[end:]
    return text[:begin] + text[end:]


def _comma(text: str, start: int, end: int) -> int:
    """Where the comma is in a stretch that may hold comments."""
    return start + _COMMENT.sub(lambda found: " " * len(found[0]), text[start:end]).index(",")


def _entry(key: str | None, value: Any) -> str:
    return written(value) if key is None else f"{written(key)}: {written(value)}"


def _block(key: str | None, value: Any, indent: str, line: str) -> str:
    """An entry or item in lines of its own; a section that begins with it has its first entry below it."""
    if key is None:
        is_plain = isinstance(value, str) and _PLAIN_ITEM.match(value)
        return f"- {value if is_plain else written(value)}"
    if isinstance(value, list) and len(value) == 1:
        return f"{written(key)}:{line}{indent}  {_block(None, value[0], indent, line)}"
    if isinstance(value, dict) and len(value) == 1 and isinstance(inner := next(iter(value.values())), dict):
        return f"{written(key)}:{line}{indent}  {_entry(next(iter(value)), inner)}"
    return _entry(key, value)


def _end(part: Part, number: int) -> int:
    """Where an item ends; one without a value, with its key."""
    return max(part.items[number].end, part.keys[number].end if part.keys else 0)


def _is_empty(part: Part) -> bool:
    return part.kind == "scalar" and not part.text and part.start == part.end


def _has_gaps(text: str, part: Part) -> bool:
    """Whether empty lines are between its entries."""
    return any(
        re.search(r"\n[ \t]*\r?\n", text[part.items[number].end : part.begin(text, number + 1)])
        for number in range(len(part.items) - 1)
    )


def _line_start(text: str, at: int) -> int:
    return text.rfind("\n", 0, at) + 1


def _line_end(text: str, at: int) -> int:
    """Where a line ends, before its line break."""
    end = text.find("\n", at)
    return len(text) if end < 0 else end - (text[end - 1 : end] == "\r")


def _break(text: str) -> str:
    return "\r\n" if "\r\n" in text else "\n"


def path(keys: Keys) -> str:
    """Keys as people write them."""
    return ".".join(map(str, keys))
