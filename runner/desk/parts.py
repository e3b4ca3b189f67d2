"""The data that a text holds, and how other data are written into it in place: all else stays as it is."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from difflib import SequenceMatcher
from typing import Any

import yaml_edit

from epicycle.actors import EpicycleError

from ..model.language.models import COMPOSITE, MODEL
from ..model.text.document import Scalar, parse, plain
from ..model.text.document import Sequence as ListNode
from ..model.text.problems import Problems
from ..model.text.scalars import resolve

Keys = tuple[str | int, ...]
SECTIONS = ("actors", "connections", "aspects")  # that go with their last entry, and whose entries have lines
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


def data_of(text: str) -> Any:
    """What a text holds, as plain data; raises ``EditError`` if it cannot be read."""
    if not _has_content(text):
        return {}
    problems = Problems()
    node = parse(text, "the text", problems)
    if problems.found:
        raise EditError(f"this can be changed once the text can be read: {problems.found[0].message}")
    return {} if node is None else plain(node)


def _has_content(text: str) -> bool:
    return bool(_COMMENT.sub("", text).strip("\ufeff \t\r\n"))


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
    before = data_of(text)
    head = "" if _has_content(text) else text if text[-1:] in ("", "\n") else f"{text}\n"
    try:
        document = yaml_edit.Document.parse(text.removeprefix(head))
        _write(document, before, after, ())
        changed = head + str(document)
    except (yaml_edit.YamlError, LookupError):  # something is other to it than to us
        changed = text
    if _canonical(data_of(changed)) != _canonical(after):
        raise EditError("this text is written in a way that no program can change here: change it by hand")
    return changed


def _write(place: Any, before: Any, after: Any, keys: Keys) -> None:
    """Make other data of some in a mapping or list of a document, at the end of keys."""
    if isinstance(before, dict):
        new = _kept(after)
        for key, value in new.items():
            if key not in before:
                place.set(key, _node(value, place, key), field_order=_ORDER)
            elif _canonical(before[key]) != _canonical(value):
                _replace(place, key, before[key], value, (*keys, key))
        for key in [each for each in _kept(before) if each not in new]:
            place.remove(key)
        return
    found = SequenceMatcher(None, [*map(_canonical, before)], [*map(_canonical, after)], autojunk=False)
    for _, a, b, c, d in reversed([each for each in found.get_opcodes() if each[0] != "equal"]):
        both = min(b - a, d - c)
        for number in reversed(range(a + both, b)):
            place.pop(number)
        for number in range(c + both, d):
            place.insert(a + number - c, _node(after[number], place))
        for number in range(both):
            _replace(place, a + number, before[a + number], after[c + number], (*keys, a + number))


def _replace(place: Any, key: str | int, before: Any, after: Any, keys: Keys) -> None:
    """Make other data of what a mapping or list has; raises ``EditError`` for an alias."""
    node = place[key]
    if node.is_alias():
        raise EditError(f"{path(*keys)} is an alias: change it by hand")
    if after and isinstance(before, (dict, list)) and isinstance(after, type(before)):
        _write(node.as_mapping() or node.as_sequence(), before, after, keys)
    else:
        place.set(key, _node(after, place, key))


def _node(value: Any, place: Any, key: str | int = 0) -> Any:
    """A value as it is written in a mapping or list: sections in lines of their own, everything else in one."""
    is_flow = getattr(place, "is_flow_style", bool)()
    if key in SECTIONS and not is_flow and isinstance(value, list):
        said = "".join(f"\n  - {_item(each)}" for each in value)
    elif key in SECTIONS and not is_flow and isinstance(value, dict):
        said = "".join(f"\n  {written(name)}: {_item(each)}" for name, each in value.items())
    else:
        said = written(value) if is_flow else _item(value)
    return yaml_edit.Document.parse(f"value: {said}\n")["value"]


def _item(value: Any) -> str:
    """A value outside of brackets, where a connection needs no quotes."""
    return value if isinstance(value, str) and _PLAIN_ITEM.match(value) else written(value)


def path(*keys: str | int) -> str:
    """Keys as people write them."""
    return ".".join(map(str, keys))
