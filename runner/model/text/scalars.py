"""Plain scalars: what a text without quotes means, by the core schema of YAML 1.2."""

import re
from typing import TypeAlias

Value: TypeAlias = str | int | float | bool | None

_MAX_DIGITS = 1_000
_NULLS = frozenset(("", "~", "null", "Null", "NULL"))
_BOOLS = {"true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False}
_SPECIAL_START = frozenset("+-.0123456789")  # most texts start differently and need no regular expression
_INT = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
_NOT_FINITE = re.compile(r"[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)")
_BASES = {"0o": 8, "0x": 16}

TAG_PREFIX = "tag:yaml.org,2002:"
SCALAR_TAGS: dict[str, tuple[type, ...]] = {
    "int": (int,),
    "float": (float, int),
    "bool": (bool,),
    "null": (type(None),),
}


def resolve(text: str) -> Value:
    """Return what a plain scalar means; raise ValueError for a number that does not fit a float."""
    if text in _NULLS:
        return None
    if text[0] not in _SPECIAL_START:
        return _BOOLS.get(text, text)
    if _INT.fullmatch(text):
        if len(text) > _MAX_DIGITS:
            raise ValueError(f"a number of {len(text)} characters is too long")
        return int(text[2:], _BASES[text[:2]]) if text[:2] in _BASES else int(text)
    if _FLOAT.fullmatch(text):
        value = float(text)
        if value in (float("inf"), float("-inf")):
            raise ValueError(f"the number {short(text)} is too large for a float")
        return value
    if _NOT_FINITE.fullmatch(text):
        return float(text.replace(".", ""))
    return text


def short(text: str) -> str:
    """A text for a message, shortened if it is very long."""
    return text if len(text) <= 40 else text[:37] + "..."


def quoted(text: str) -> str:
    """A text of one line as a file writes it in quotes."""
    is_simple = '"' not in text and "\\" not in text
    return f'"{text}"' if is_simple else "'" + text.replace("'", "''") + "'"
