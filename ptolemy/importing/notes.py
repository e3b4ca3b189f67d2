"""Notes of an import: what has no counterpart, and why a model cannot be imported."""

from __future__ import annotations

from dataclasses import dataclass, field

from epicycle.actors import counted

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
