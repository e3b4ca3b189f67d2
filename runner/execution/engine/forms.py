"""Native forms: the busiest actors of the library in C (``forms.pyx``).  In Python there are none."""

from __future__ import annotations

from collections.abc import Container, Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from epicycle.actors import Actor

    from .director import Director


def attach(director: Director, actors: Mapping[str, Actor], besides: Container[str]) -> int:
    """Let native forms fire in place of the actors that have one, except those ``besides``; returns how many."""
    return 0
