"""Native forms: the busiest actors of the library in C (``forms.pyx``).  In Python there are none."""

from __future__ import annotations

from collections.abc import Container, Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from epicycle.actors import Actor

    from .director import Director


def attach(director: Director, actors: Mapping[str, Actor], besides: Container[str]) -> int:
    """Let forms fire in the place of those actors that have one, ``besides`` some; how many do."""
    return 0
