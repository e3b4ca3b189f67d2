"""Notes of an import: what has no counterpart, and why a model cannot be imported."""

from __future__ import annotations

from dataclasses import dataclass, field

MAX_NOTES = 500


@dataclass
class Notes:
    """Lines for the user, in the order in which they were found."""

    lines: list[str] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)
    left_out: dict[str, int] = field(default_factory=dict)  # views, which are only counted

    def note(self, text: str) -> None:
        """Note that something is lost or changed, though the model can run."""
        self._add(self.lines, text)

    def error(self, text: str) -> None:
        """Note a reason why the model cannot be imported."""
        self._add(self.errors, text)

    def count(self, what: str) -> None:
        """Count something that is left out and makes no difference to a run."""
        self.left_out[what] = self.left_out.get(what, 0) + 1

    def _add(self, lines: list[str], text: str) -> None:
        if len(lines) < MAX_NOTES and text not in lines:
            lines.append(text)
        elif len(lines) == MAX_NOTES:
            lines.append(f"(only the first {MAX_NOTES} lines are shown)")

    def summary(self) -> str:
        """One line for everything that was only counted."""
        told = [f"{count} {what if count == 1 else what + 's'}" for what, count in sorted(self.left_out.items())]
        return f"left out: layout{''.join(', ' + each for each in told)}"
