"""What an expression may cost, and its values may take."""

from __future__ import annotations

from ..core import MAX_DEPTH

MAX_STEPS = 100_000
MAX_ELEMENTS = 100_000
MAX_TEXT = 10_000


class BudgetError(Exception):
    """An expression costs too much."""


class Budget:
    """What may still be spent, by one evaluation or, as the ``whole``, by several.

    A step is one part of an expression, or ten elements or characters.
    """

    def __init__(self, steps: int = MAX_STEPS, what: str = "this takes", whole: Budget | None = None) -> None:
        self._steps = self._left = steps
        self._what = what
        self._whole = whole

    @property
    def is_spent(self) -> bool:
        """Whether more was requested than was left."""
        return self._left < 0

    def spend(self, steps: int) -> None:
        """Deduct some steps, or raise if there are not enough left."""
        if self._whole is not None:
            self._whole.spend(steps)
        self._left -= steps
        if self._left < 0:
            raise BudgetError(f"{self._what} more than {self._steps:,} steps")

    def pay(self, value: object) -> None:
        """Pay for a value that was made, by its length, or raise if it is too long."""
        if isinstance(value, str):
            check_text(len(value))
            self.spend(len(value) // 10)
        elif isinstance(value, (list, tuple, dict)):
            check_elements(len(value))
            self.spend(len(value) // 10)

    def weigh(self, value: object) -> None:
        """Pay for a value that is searched, by its size at all levels, or raise if it is too large."""
        if isinstance(value, (list, tuple, dict)):
            self.spend(size_of(value) // 10)
        else:
            self.pay(value)


def size_of(value: object) -> int:
    """Count the elements at all levels, shared ones as often as they appear; a text counts by its length."""
    size = depth = 0
    level = [value]
    while level:
        inner: list[object] = []
        for item in level:
            if isinstance(item, str):
                size += len(item) // 10
            elif isinstance(item, (list, tuple, dict)):
                size += len(item)
                check_elements(size)
                inner += item.values() if isinstance(item, dict) else item
        level = inner
        depth += 1
        if depth > MAX_DEPTH and level:
            raise BudgetError(f"nested deeper than {MAX_DEPTH} levels")
    check_elements(size)
    return size


def check_text(length: int) -> None:
    """Raise if a text is too long."""
    if length > MAX_TEXT:
        raise BudgetError(f"a text of more than {MAX_TEXT:,} characters is too long")


def check_elements(count: int) -> None:
    """Raise if there are too many elements."""
    if count > MAX_ELEMENTS:
        raise BudgetError(f"a list of more than {MAX_ELEMENTS:,} elements is too long")
