"""Writes YAML as a person would: short values on one line, sections in the usual order."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

WIDTH = 118
_PLAIN = re.compile(r"[A-Za-z_./][A-Za-z0-9_./*%()\[\], +^<>=;-]*\Z")
_IN_FLOW = re.compile(r"[\[\]{},]")
_SPECIAL = {"true", "false", "null", "yes", "no", "on", "off", "~", "y", "n"}
_BARE_KEY = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")
_QUANTITY = re.compile(r"-?\d+(\.\d+)?(e-?\d+)? (s|ms|us|ns)\Z")


class Flow(dict[str, object]):
    """A mapping that is written on one line if it fits."""


def plain(value: Any) -> object:
    """A value of Ptolemy's in its YAML form; raises ``ValueError``."""
    if isinstance(value, list):
        return [plain(each) for each in value]
    if isinstance(value, dict):
        return {name: plain(each) for name, each in value.items()}
    if isinstance(value, float) and math.isnan(value):
        raise ValueError("NaN cannot be written")
    if value is not None and not isinstance(value, (bool, int, float, str)):
        raise ValueError("a function cannot be written")
    return value.replace("${", "$${") if isinstance(value, str) else value


def seconds(value: Any) -> object:
    """A time in s, in the form in which models state it; raises ``ValueError``."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError(f"{value!r} is not a time")
    if math.isinf(value):
        return float(value)
    number = int(value) if float(value).is_integer() and abs(value) < 1e15 else value
    return f"{number!r} s"


def scalar(value: object, *, flow: bool = False) -> str:
    """A value without parts; ``flow``: inside brackets."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if value is None:
        return "null"
    if isinstance(value, float):
        if math.isinf(value):
            return ".inf" if value > 0 else "-.inf"
        text = repr(value)
        return text if "." in text or "e" not in text else text.replace("e", ".0e")
    if isinstance(value, int):
        return str(value)
    text = str(value)
    is_plain = _QUANTITY.match(text) or (
        _PLAIN.match(text)
        and text.lower() not in _SPECIAL
        and not text.endswith((" ", ":"))
        and not (flow and _IN_FLOW.search(text))
        and not text.startswith("- ")
        and not re.match(r"\.?(inf|nan|\d)", text, re.IGNORECASE)
    )
    return text if is_plain else json.dumps(text, ensure_ascii=not text.isprintable())


def line(value: object) -> str:
    """A value on one line, inside of brackets."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_key(key)}: {line(each)}" for key, each in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(line, value)) + "]"
    return scalar(value, flow=True)


def _key(key: object) -> str:
    text = str(key)
    return text if _BARE_KEY.match(text) and text.lower() not in _SPECIAL - {"on", "y", "n"} else json.dumps(text)


def block(value: Mapping[str, object], indent: int = 0) -> Iterable[str]:
    """The lines of a mapping."""
    start = " " * indent
    for key, each in value.items():
        head = f"{start}{_key(key)}:"
        if isinstance(each, Mapping) and not isinstance(each, Flow) and each:
            yield head
            yield from block(each, indent + 2)
        elif isinstance(each, Flow) and len(head) + 1 + len(line(each)) > WIDTH and len(each) > 1:
            yield head
            yield from block(
                {key: Flow(part) if isinstance(part, Mapping) else part for key, part in each.items()}, indent + 2
            )
        elif isinstance(each, (list, tuple)) and each and _is_long(head, each):
            yield head
            for item in each:
                yield f"{start}  - {line(item) if isinstance(item, (Mapping, list, tuple)) else scalar(item)}"
        elif isinstance(each, (Mapping, list, tuple)):
            yield f"{head} {line(each)}"
        else:
            yield head if each is None else f"{head} {scalar(each)}"


def _is_long(head: str, items: Sequence[object]) -> bool:
    return head.strip() in ("connections:", "transitions:") or len(head) + 1 + len(line(items)) > WIDTH
