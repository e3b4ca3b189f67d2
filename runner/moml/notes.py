"""What is said of an import: what has no counterpart, and why a model cannot be said at all."""

from __future__ import annotations

from dataclasses import dataclass, field

MAX_NOTES = 500


@dataclass
class Notes:
    """Lines for the reader, in the order in which they came up."""

    lines: list[str] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)
    left_out: dict[str, int] = field(default_factory=dict)  # layout and views, which are only counted

    def note(self, text: str) -> None:
        """Something is lost or another, though the model can be run."""
        self._add(self.lines, text)

    def error(self, text: str) -> None:
        """The model cannot be said."""
        self._add(self.errors, text)

    def count(self, what: str) -> None:
        """Something is left out that nobody misses in a run."""
        self.left_out[what] = self.left_out.get(what, 0) + 1

    def _add(self, lines: list[str], text: str) -> None:
        if len(lines) < MAX_NOTES and text not in lines:
            lines.append(text)
        elif len(lines) == MAX_NOTES:
            lines.append(f"after {MAX_NOTES} lines it is enough")

    def summary(self) -> str:
        """One line for all that was only counted."""
        told = [f"{count} {what if count == 1 else what + 's'}" for what, count in sorted(self.left_out.items())]
        return f"left out: layout{''.join(', ' + each for each in told)}"
