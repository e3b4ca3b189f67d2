"""Shapes of plain data: what was written by us can be told from what was not."""

from __future__ import annotations

from typing import Any


def fits(value: Any, shape: Any) -> bool:
    """Whether plain data has a shape.

    This is a type or None, some of the texts (a frozenset), a range of whole numbers, one of several shapes (a tuple),
    a list of shapes, or of one for all items, a record, or ``{str: shape}`` for a mapping with any keys.
    """
    match shape:
        case tuple():
            return any(fits(value, each) for each in shape)
        case list():
            if not isinstance(value, list) or len(shape) not in (1, len(value)):
                return False
            return all(map(fits, value, shape if len(shape) > 1 else shape * len(value)))
        case dict():
            has_keys = isinstance(value, dict) and (str in shape or value.keys() == shape.keys())
            return has_keys and all(fits(each, shape.get(str) or shape[name]) for name, each in value.items())
        case range():
            return type(value) is int and value in shape  # for any other type it would compare every number
        case frozenset():
            return type(value) is str and value in shape
    return value is None if shape is None else type(value) is shape
