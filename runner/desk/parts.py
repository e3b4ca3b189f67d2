"""The parts of a text, with their ends, and how other data are written into it in place: all else stays as it is.

The nodes of ``text/document.py`` know where they begin; a change must also know where they end.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from difflib import SequenceMatcher
from typing import Any

import yaml
from yaml.events import AliasEvent, CollectionEndEvent, CollectionStartEvent, MappingStartEvent, NodeEvent

from epicycle.actors import EpicycleError

from ..model.language.models import COMPOSITE, MODEL
from ..model.text.document import LOADER, Scalar, parse, plain
from ..model.text.document import Sequence as ListNode
from ..model.text.problems import Problems
from ..model.text.scalars import resolve

Keys = tuple[str | int, ...]
SECTIONS = ("actors", "connections", "aspects")  # that go with their last entry
_ORDER = tuple(dict.fromkeys((*("model", "doc", "extends", "include", "composites"), *MODEL.keys, *COMPOSITE.keys)))
_PLAIN = re.compile(r"[A-Za-z0-9_.+*/^%°$(<>=-][A-Za-z0-9_.+*/^%°$()<>= -]*\Z")
_PLAIN_ITEM = re.compile(
    r"[A-Za-z_][\w.\[\]*, ]* [=-]> [\w.\[\]*, ]*\w\Z", re.ASCII
)  # a connection, outside of brackets
_COMMENT = re.compile(r"(?<!\S)#[^\n]*")
_BREAKS = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029\ufeff]")


class EditError(EpicycleError):
    """A change that cannot be made in this text."""


@dataclass(frozen=True)
class Said:
    """A value as somebody has typed it, and as data."""

    text: str
    data: Any


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
        """The number of a key's value among the items; -1 if no text is that key."""
        if isinstance(key, int):
            return key
        return next((number for number, each in enumerate(self.keys) if each.text == key), -1)

    def begin(self, text: str, number: int) -> int:
        """Where an item begins, with its key or its dash."""
        start = (self.keys or self.items)[number].start
        return text.rfind("-", 0, start) if self.kind == "list" and not self.is_flow else start

    def stop(self, number: int) -> int:
        """Where an item ends; one without a value, with its key."""
        return max(self.items[number].end, self.keys[number].end if self.keys else 0)


def data_of(text: str) -> Any:
    """What a text holds, as plain data; raises ``EditError`` if it cannot be read."""
    if not _COMMENT.sub("", text).strip("\ufeff \t\r\n"):
        return {}
    problems = Problems()
    node = parse(text, "the text", problems)
    if problems.found:
        raise EditError(f"this can be changed once the text can be read: {problems.found[0].message}")
    return {} if node is None else plain(node)


def parts_of(text: str) -> Part | None:
    """The outermost part of a text that can be read; None if it is empty."""
    mark = text.startswith("\ufeff")
    stack, root = list[Part](), None
    for event in yaml.parse(text[mark:], Loader=LOADER):
        start, end = (at.index + mark if at else 0 for at in (event.start_mark, event.end_mark))
        if isinstance(event, CollectionEndEvent):
            made = stack.pop()
            made.end = end if made.is_flow else max(each.end for each in (*made.keys, *made.items))
        elif isinstance(event, NodeEvent):
            kind = "mapping" if isinstance(event, MappingStartEvent) else "list"
            made = Part(kind, start, start + len(text[start:end].rstrip()), getattr(event, "flow_style", False))
            if not isinstance(event, CollectionStartEvent):
                made.kind = "alias" if isinstance(event, AliasEvent) else "scalar"
                made.text = getattr(event, "value", "")
            around = stack[-1] if stack else None
            if around is None:
                root = root or made
            else:
                is_key = around.kind == "mapping" and len(around.keys) == len(around.items)
                (around.keys if is_key else around.items).append(made)
            if isinstance(event, CollectionStartEvent):
                stack.append(made)
    return root


def _along(text: str, keys: Keys) -> list[Part]:
    """The parts that some keys lead through, the outermost one first; raises ``EditError`` for an alias."""
    root = parts_of(text)
    assert root is not None
    found = [root]
    for number in range(len(keys) + 1):
        if found[-1].kind == "alias":
            raise EditError(f"{path(*keys[:number])} is an alias: change it by hand")
        if number < len(keys):
            found.append(found[-1].items[found[-1].find(keys[number])])
    return found


# -- values -----------------------------------------------------------------------------------------------------------


def quoted(value: str) -> str:
    """A text in quotes, whatever it holds."""
    if any("\ud800" <= each <= "\udfff" for each in value):
        raise EditError("a text cannot hold half of a character")
    return _BREAKS.sub(lambda found: f"\\u{ord(found[0]):04x}", json.dumps(value, ensure_ascii=False))


def written(value: Any) -> str:
    """A value as a file writes it on one line, within brackets or not."""
    if isinstance(value, Said):
        return value.text
    if isinstance(value, dict):
        return "{" + ", ".join(f"{written(key)}: {written(each)}" for key, each in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(written, value)) + "]"
    if not isinstance(value, str):
        return json.dumps(value)
    is_plain = _PLAIN.match(value) and not re.search(r"\s\Z|---|\A[-*%=>] |\A[*%>=]|\A-\Z", value)
    return value if is_plain and resolve(value) == value else quoted(value)


def typed(said: str) -> Said:
    """What somebody typed as a value: as it is, if it is one value, otherwise as text."""
    said = said.strip()
    if said and said[0] not in "&*!" and _BREAKS.search(said) is None and _COMMENT.search(said) is None:
        problems = Problems()
        node = parse(f"[{said}]", "", problems)
        items = node.items if isinstance(node, ListNode) else ()
        if not problems.found and len(items) == 1 and (said[0] in "[{\"'" or isinstance(items[0], Scalar)):
            return Said(said, plain(items[0]))
    return Said(quoted(said), said)


def _canonical(data: Any) -> str:
    """Data as text: true is not 1, entries have no order, and an empty section is none."""
    if isinstance(data, dict):
        return "{" + ", ".join(sorted(f"{key!r}: {_canonical(value)}" for key, value in _kept(data).items())) + "}"
    if isinstance(data, Said):
        return _canonical(data.data)
    return f"[{', '.join(map(_canonical, data))}]" if isinstance(data, list) else repr(data)


def _kept(data: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in data.items() if key not in SECTIONS or value not in (None, {}, [])}


# -- changes ----------------------------------------------------------------------------------------------------------


def rendered(text: str, after: Any) -> str:
    """The text with other data, by the smallest changes; raises ``EditError`` if it cannot be written so."""
    changed = text
    for act, keys, value in _steps(data_of(text), after, ()):
        changed = act(changed, keys, value)
    if _canonical(data_of(changed)) != _canonical(after):
        raise EditError("this text is written in a way that no program can change here: change it by hand")
    return changed


def _steps(before: Any, after: Any, keys: Keys) -> Iterator[tuple[Callable[[str, Keys, Any], str], Keys, Any]]:
    """What makes other data of some, at the end of keys; in lists from behind, so that numbers stay right."""
    if _canonical(before) == _canonical(after):
        return
    if isinstance(before, dict) and isinstance(after, dict) and after:
        new = _kept(after)
        for key, value in new.items():
            if key in before:
                yield from _steps(before[key], value, (*keys, key))
            else:
                yield _add, (*keys, key), value
        yield from ((_delete, (*keys, key), None) for key in _kept(before) if key not in new)
    elif isinstance(before, list) and isinstance(after, list) and after:
        found = SequenceMatcher(None, [*map(_canonical, before)], [*map(_canonical, after)], autojunk=False)
        for _, a, b, c, d in reversed([each for each in found.get_opcodes() if each[0] != "equal"]):
            both = min(b - a, d - c)
            yield from ((_delete, (*keys, number), None) for number in reversed(range(a + both, b)))
            yield from ((_add, (*keys, len(before)), value) for value in after[c + both : d])
            for number in range(both):
                yield from _steps(before[a + number], after[c + number], (*keys, a + number))
    else:
        yield _put, keys, after


def _put(text: str, keys: Keys, value: Any) -> str:
    """The text with a value in place of another."""
    *around, part = _along(text, keys)
    if part.start < part.end:
        return text[: part.start] + _item(value, around) + text[part.end :]
    key = around[-1].keys[around[-1].find(keys[-1])]  # without a value, perhaps without a colon
    if isinstance(value, (dict, list)) and not around[-1].is_flow:
        start, end = _line_start(text, key.start), _line_end(text, key.end)
        return text[:end] + _rows(value, " " * (key.start - start + 2), _break(text)) + text[end:]
    colon = text.find(":", key.end, part.start + 1)
    at = key.end if colon < 0 else colon + 1
    return f"{text[:at]}{': ' if colon < 0 else ' '}{written(value)}{text[at:]}"


def _add(text: str, keys: Keys, value: Any) -> str:
    """The text with another entry in a mapping, or item in a list: behind the others, or where keys have an order."""
    key, line = keys[-1], _break(text)
    if parts_of(text) is None:
        before = text if not text or text.endswith("\n") else text + line
        return f"{before}{_block(key, value, '', line)}{line}"
    part = _along(text, keys[:-1])[-1]
    if part.is_flow:
        entry = written(value) if isinstance(key, int) else f"{written(key)}: {written(value)}"
        if not part.items:
            return f"{text[: part.end - 1]}{entry}{text[part.end - 1 :]}"
        end, begin = part.stop(-1), part.begin(text, len(part.items) - 1)
        indent = text[_line_start(text, begin) : begin]
        if indent.strip():
            return f"{text[:end]}, {entry}{text[end:]}"
        following = _line_end(text, end) if "#" in text[end : _line_end(text, end)] else end
        return f"{text[:end]},{text[end:following]}{line}{indent}{entry}{text[following:]}"
    begin = part.begin(text, 0)
    indent = " " * (begin - _line_start(text, begin))
    before_it = len(part.items)
    if key in _ORDER:
        earlier = _ORDER[: _ORDER.index(str(key)) + 1]
        before_it = 1 + max((number for number, each in enumerate(part.keys) if each.text in earlier), default=-1)
    entry = _block(key, value, indent, line)
    if before_it == 0:
        return f"{text[:begin]}{entry}{line}{indent}{text[begin:]}"
    if len(keys) == 1 and _has_gaps(text, part):
        indent = line + indent
    end = _line_end(text, part.items[before_it - 1].end)
    return f"{text[:end]}{line}{indent}{entry}{text[end:]}"


def _delete(text: str, keys: Keys, value: None) -> str:
    """The text without an entry or item, and the comment behind it."""
    part = _along(text, keys[:-1])[-1]
    number = part.find(keys[-1])
    begin, end = part.begin(text, number), part.stop(number)
    if not part.is_flow:
        start = _line_start(text, begin)
        if text[start:begin].strip():  # behind the dash of a list
            return text[:begin] + text[part.begin(text, number + 1) :]
        return text[:start] + text[_line_end(text, end) :].removeprefix("\r").removeprefix("\n")
    if number + 1 < len(part.items):  # with the comma behind it
        stop = part.begin(text, number + 1)
        kept = text[_comma(text, end, stop) + 1 : stop].lstrip(" ")
    elif number:  # with the comma before it
        end, begin, stop = begin, _comma(text, part.stop(number - 1), begin), end
        kept = text[begin + 1 : end].rstrip(" ")
    else:
        stop, kept = end, ""
    return text[:begin] + (kept if kept.strip() else "") + text[stop:]  # comments stay


def _comma(text: str, start: int, end: int) -> int:
    """Where the comma is in a stretch that may hold comments."""
    return start + _COMMENT.sub(lambda found: " " * len(found[0]), text[start:end]).index(",")


def _item(value: Any, around: Sequence[Part]) -> str:
    """A value as it is written within some parts: a connection outside of brackets needs no quotes."""
    is_plain = isinstance(value, str) and _PLAIN_ITEM.match(value) and not any(each.is_flow for each in around)
    return str(value) if is_plain else written(value)


def _block(key: str | int, value: Any, indent: str, line: str) -> str:
    """An entry or item in lines of its own; those of a section stand below it."""
    if isinstance(key, int):
        return f"- {_item(value, ())}"
    is_section = key in SECTIONS and isinstance(value, (dict, list))
    return f"{written(key)}:{_rows(value, f'{indent}  ', line) if is_section else f' {written(value)}'}"


def _rows(value: dict[str, Any] | list[Any], indent: str, line: str) -> str:
    """Entries or items, each behind a line break."""
    rows = value.items() if isinstance(value, dict) else enumerate(value)
    return "".join(f"{line}{indent}{_block(key, each, indent, line)}" for key, each in rows)


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


def path(*keys: str | int) -> str:
    """Keys as people write them."""
    return ".".join(map(str, keys))
