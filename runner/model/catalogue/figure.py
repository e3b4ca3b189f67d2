"""What a figure of a run declares; its class knows how to draw it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar, Literal

from epicycle.actors import Configurable, variants

Shape = Literal["body", "ellipse", "tube", "line", "goal"]


@dataclass(frozen=True)
class Mark:
    """Something in space that a page of a run shows, each row from its time (s) on until the next; lengths in m.

    A row of a ``body`` or a ``goal`` is x, y; of an ``ellipse`` x, y, both half axes and the angle (rad) of the first;
    of a ``tube`` x, y and radius of one circle after the other; of a ``line`` both ends.  ``radius`` is drawn around a
    body.  ``colour`` is a place in the palette; None is the colour of limits and goals.
    """

    name: str
    shape: Shape
    times: Sequence[float]
    rows: Any  # array of shape (n, k)
    radius: float = 0.0
    colour: int | None = None


class Figure(Configurable):
    """Base of the figures of a run: declare parameters, write ``draw``, and ``marks`` if it shows a space."""

    reserved: ClassVar[frozenset[str]] = frozenset({"type", "inherit"})

    def signal_patterns(self) -> tuple[str, ...]:
        """The signals that the figure reads, as patterns; each must be recorded."""
        raise NotImplementedError

    def mark_patterns(self) -> tuple[str, ...]:
        """Signals that ``marks`` reads beside these, as patterns; a page records them itself."""
        return ()

    def marks(self, results: Any) -> Iterable[Mark]:
        """What in a run's ``Results`` has a place in space."""
        return ()

    def draw(self, results: Any, path: Path) -> None:
        """Draw the figure of a run's ``Results`` into a file, whose ending decides the format."""
        raise NotImplementedError


def own_figures() -> dict[str, type[Figure]]:
    """The figures that Epicycle and the running program define, by name."""
    for name in ("figures", "trajectories"):
        import_module(f"...show.{name}", __package__)
    return dict(sorted(variants(Figure).items()))
