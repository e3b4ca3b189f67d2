"""What a figure of a run declares; how one is drawn, only its class knows."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar

from epicycle.actors import Configurable, variants


class Figure(Configurable):
    """Base of the figures of a run: declare parameters, write ``draw``."""

    reserved: ClassVar[frozenset[str]] = frozenset({"type"})

    def signal_patterns(self) -> tuple[str, ...]:
        """The signals that the figure reads, as patterns; each must be recorded."""
        raise NotImplementedError

    def draw(self, results: Any, path: Path) -> None:
        """Draw the figure of a run's ``Results`` into a file, whose ending decides the format."""
        raise NotImplementedError


def own_figures() -> dict[str, type[Figure]]:
    """The figures that Epicycle and the running program define, by name."""
    import_module("..show", __package__)
    return dict(sorted(variants(Figure).items()))
