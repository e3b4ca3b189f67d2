"""Tokens as the expression language knows them."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from typing import Any, Final

import numpy as np

_PLAIN: Final = frozenset({bool, int, float, str, type(None)})
_TEXT: Final = frozenset({str})


def operand(token: Any) -> Any:
    """A token as the expression language knows it: arrays become lists, dataclasses dicts of their fields."""
    if (kind := type(token)) in _PLAIN:
        return token
    if kind is dict and _TEXT.issuperset(map(type, token)) and _PLAIN.issuperset(map(type, token.values())):
        return token.copy()
    if isinstance(token, (np.generic, np.ndarray)):  # one that is also a float divides by zero without an error
        return token.tolist()
    if isinstance(token, (bool, int, float, str)):
        return token
    if isinstance(token, (list, tuple)):
        return [operand(item) for item in token]
    if isinstance(token, Mapping):
        found = {str(key): operand(item) for key, item in token.items()}
        if len(found) < len(token):  # a text goes before anything else with that text
            found.update((key, operand(item)) for key, item in token.items() if type(key) is str)
        return found
    if dataclasses.is_dataclass(token) and not isinstance(token, type):
        return {each.name: operand(getattr(token, each.name)) for each in dataclasses.fields(token)}
    return token


def value_at(token: Any, fields: Iterable[str]) -> Any:
    """A part of a token; None if there is no such part."""
    for name in fields:
        token = token.get(name) if isinstance(token, Mapping) else getattr(token, name, None)
    return token
