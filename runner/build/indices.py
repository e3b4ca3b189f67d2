"""Which instances of an array stand between the brackets of ``name[...]``, in which order.

``*`` is all, ``2`` one, ``-1`` the last, ``0..3`` a range with both ends, ``1..`` and ``..-2`` ranges up to an end of
the array, ``1.., 0`` several in that order, and ``${...}`` a number, or a list of numbers, that is computed.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from ..text import split

_NUMBER = re.compile(r"-?\d{1,9}", re.ASCII)
_EXPRESSION = re.compile(r"\$\{.*\}", re.DOTALL)


MAX_INDICES = 1_000_000


class BadIndexError(Exception):
    """Text that names no instances; the message says why, ``is_misshapen`` that it is no index at all."""

    def __init__(self, message: str, *, is_misshapen: bool = False) -> None:
        super().__init__(message)
        self.is_misshapen = is_misshapen


def resolve(text: str, array: str, count: int, value: Callable[[str], object]) -> tuple[list[int], bool]:
    """The indices that a text stands for in an array of that name and ``count``, and whether it may be several.

    In an empty array every index stands for none, so that a model stays right when a count becomes zero.  ``value``
    evaluates a ``${...}``.  Raises ``BadIndexError``.
    """
    items = [text[start:end].strip() for start, end in split(text, ",")]
    found: list[int] = []
    if len(items) * count > MAX_INDICES:
        raise BadIndexError(f"too many instances: {len(items):,} times up to {count:,}")
    several = len(items) > 1
    for item in items:
        ends = [item[start:end].strip() for start, end in split(item, "..")]
        if item == "*" or len(ends) == 2:
            several = True
            found += range(count) if item == "*" else _range(ends[0], ends[1], item, array, count, value)
            continue
        number = _number(item, value)
        numbers: list[object] = number if isinstance(number, list) else [number]
        several = several or isinstance(number, list)
        for each in numbers if count else ():
            index = _whole(each, item)
            place = index + count if index < 0 and _NUMBER.fullmatch(item) else index
            if not 0 <= place < count:
                raise BadIndexError(_missing(array, index, count))
            found.append(place)
    return found, several


def _range(left: str, right: str, item: str, array: str, count: int, value: Callable[[str], object]) -> range:
    """Both ends included; one that is left out or counted from the end goes no further than the array."""
    start, end = (_whole(_number(each, value), item) if each else default for each, default in ((left, 0), (right, -1)))
    from_end = [not each or bool(_NUMBER.fullmatch(each) and each.startswith("-")) for each in (left, right)]
    if not count:
        return range(0)
    if left.startswith("-") and from_end[0]:
        start = max(start + count, 0)
    if from_end[1]:
        end += count
    is_written = all(_NUMBER.fullmatch(each) for each in (left, right))
    if end < start and (any(from_end) or (end == start - 1 and not is_written)):
        return range(0)
    if end < start:
        raise BadIndexError(f"{array}[{item}]: the range {start}..{end} runs backwards")
    for bound in (start, end):
        if not 0 <= bound < count:
            raise BadIndexError(_missing(array, bound, count))
    return range(start, end + 1)


def _missing(array: str, index: int, count: int) -> str:
    return f"there is no {array}[{index}]: the array has {count}, the last is {array}[{count - 1}]"


def _number(text: str, value: Callable[[str], object]) -> object:
    if _NUMBER.fullmatch(text):
        return int(text)
    if _EXPRESSION.fullmatch(text):
        return value(text)
    raise BadIndexError(f"{text!r} is no index of an array", is_misshapen=True)


def _whole(value: object, item: str) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not float(value).is_integer():
        raise BadIndexError(f"{item} is {value!r}, but an index is a whole number")
    return int(value)
