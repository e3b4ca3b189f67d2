"""From a figure to what is drawn."""

from __future__ import annotations

from pathlib import Path

from epicycle.actors import EpicycleError, readable

from ..catalogue import Figure
from ..results import Results
from ..text import Position, describe, raised_at, told_raised
from .pen import style


class FigureError(EpicycleError):
    """A figure cannot be drawn; ``raised`` is the line of a user's class from which the exception comes."""

    def __init__(self, name: str, reason: str, raised: Position | None = None) -> None:
        super().__init__(name, reason, raised)
        self.name = name
        self.reason = reason
        self.raised = raised

    def __str__(self) -> str:
        lines = [readable(f"figure {self.name} cannot be drawn: {self.reason}")]
        return "\n".join([*lines, *(told_raised(self.raised) if self.raised is not None else [])])


def draw(name: str, figure: Figure, results: Results, path: Path) -> None:
    """Draw a figure into a file; raises ``FigureError`` for whatever its class raises."""
    try:
        with style():
            figure.draw(results, path)
    except Exception as error:
        raise FigureError(name, describe(error), raised_at(error)) from error
