"""The steps that one import may take, whatever its parts do with them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from epicycle.actors.expression import Budget

MAX_STEPS = 1_000_000

_BUDGET: ContextVar[Budget | None] = ContextVar("_BUDGET", default=None)


@contextmanager
def limited_steps() -> Iterator[None]:
    """Give all that is done inside one budget; ``spend`` raises ``BudgetError`` when it is spent."""
    token = _BUDGET.set(Budget(MAX_STEPS, "it takes"))
    try:
        yield
    finally:
        _BUDGET.reset(token)


def budget() -> Budget:
    """The budget of the import, or one for each question outside of an import."""
    return _BUDGET.get() or Budget()


def spend(steps: int = 1) -> None:
    """Deduct some steps: one is a part of an expression, or ten elements or characters."""
    budget().spend(steps)
