"""The steps that one import may take, whatever its parts do with them, and the values that it may compute."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from epicycle.actors.expression import Budget, BudgetError

from .syntax import ExpressionError

MAX_ELEMENTS = 100_000  # beyond which ``Budget`` stops to count
MAX_STEPS = 1_000_000
COPY = 5  # steps for a copy of an entity, port, property, relation or link
_LARGEST = 2**63

_BUDGET: ContextVar[Budget | None] = ContextVar("_BUDGET", default=None)


@contextmanager
def limited_steps() -> Iterator[None]:
    """Give all that is done inside one budget; ``spend`` raises ``BudgetError`` when it is spent."""
    token = _BUDGET.set(Budget(MAX_STEPS, "it takes"))
    try:
        yield
    finally:
        _BUDGET.reset(token)


def spend(steps: int = 1) -> None:
    """Deduct some steps: one is a part of an expression, or ten elements or characters."""
    (_BUDGET.get() or Budget()).spend(steps)


def weigh(value: object) -> None:
    """Pay for a value by its size; raises ``ExpressionError`` if it is too large by itself."""
    if type(value) in (float, bool):
        return
    budget = _BUDGET.get() or Budget()
    try:
        budget.weigh(value)
    except BudgetError as error:
        if budget.is_spent:
            raise
        budget.spend(MAX_ELEMENTS // 10)  # at most so many were counted
        raise ExpressionError(str(error)) from None
    stack = [value]
    while stack:
        item = stack.pop()
        if isinstance(item, int) and not -_LARGEST <= item < _LARGEST:
            raise ExpressionError("a whole number must be at least -2^63 and less than 2^63")
        if isinstance(item, (list, dict)):
            budget.spend(len(item) // 10)
            stack += item.values() if isinstance(item, dict) else item
