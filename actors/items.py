"""Arithmetic on tokens that are not numbers: lists item by item, records field by field, texts joined."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from typing import Any

from .core import EpicycleError, counted
from .expression import operand, text_of


def added(left: Any, right: Any) -> Any:
    """The sum; if one side is a text, both are joined as texts."""
    if isinstance(left, str) or isinstance(right, str):
        return text_of(left) + text_of(right)
    return item_by_item(left, right, operator.add)


def less(left: Any, right: Any) -> Any:
    """The difference."""
    return item_by_item(left, right, operator.sub)


def item_by_item(left: Any, right: Any, compute: Callable[[Any, Any], Any]) -> Any:
    """A sum or similar of numbers, of lists of them, or of fields that both sides have; a number is combined with each
    item of a list."""
    left, right = operand(left), operand(right)
    if isinstance(left, Mapping) and isinstance(right, Mapping):
        return {name: item_by_item(left[name], right[name], compute) for name in left if name in right}
    lists = [isinstance(each, (list, tuple)) for each in (left, right)]
    if any(lists) and not any(isinstance(each, (str, Mapping)) for each in (left, right)):
        if all(lists) and len(left) != len(right):
            raise EpicycleError(f"{left!r} has {counted(len(left), 'item')}, but {right!r} has {len(right)}")
        count = len(left if lists[0] else right)
        pairs = zip(left if lists[0] else [left] * count, right if lists[1] else [right] * count, strict=True)
        return [item_by_item(one, other, compute) for one, other in pairs]
    if not isinstance(left, (int, float)) or not isinstance(right, (int, float)):
        raise EpicycleError(f"{left!r} and {right!r} cannot be combined")
    return compute(left, right)
