"""Modal models and state machines."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .composites import Conversion, Level, Part
    from .entities import Entity


def machine_part(conversion: Conversion, child: Entity, level: Level, name: str) -> Part | None:
    conversion.notes.error(f"{level.told(child.name)} is a state machine")
    return None
