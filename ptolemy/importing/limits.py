"""What one import may take and tell: its steps, whatever its parts do with them, and its notes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field

from epicycle.actors import counted
from epicycle.actors.expression import Budget

MAX_NOTES = 500


@dataclass
class Notes:
    """Lines for the user, in the order in which they were found."""

    lines: list[str] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)
    views: int = 0  # what only displays something is left out, and counted

    def note(self, text: str) -> None:
        """Note that something is lost or changed, though the model can run."""
        self._add(self.lines, text)

    def error(self, text: str) -> None:
        """Note a reason why the model cannot be imported."""
        self._add(self.errors, text)

    def _add(self, lines: list[str], text: str) -> None:
        if len(lines) < MAX_NOTES and text not in lines:
            lines.append(text)
        elif len(lines) == MAX_NOTES:
            lines.append(f"(only the first {MAX_NOTES} lines are shown)")

    def summary(self) -> str:
        """One line for everything that makes no difference to a run."""
        return "left out: layout" + (f", {counted(self.views, 'view')}" if self.views else "")


# -- steps ------------------------------------------------------------------------------------------------------------


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
