"""Which types a model may name: the actors, aspects and figures that are installed."""

from __future__ import annotations

from functools import cache
from inspect import isabstract
from typing import Any

import epicycle.actors
import epicycle.aspects
from epicycle.actors import Actor, Process
from epicycle.aspects import Aspect


@cache
def actor_types() -> dict[str, type[Actor]]:
    """Every actor that the house's public face offers, by name."""
    return {name: found for name, found in _public(epicycle.actors, Actor) if found not in (Actor, Process)}


@cache
def aspect_types() -> dict[str, type[Aspect]]:
    """Every aspect that the house's public face offers, by name; bases that define no behaviour are left out."""
    return {
        name: found
        for name, found in _public(epicycle.aspects, Aspect)
        if found.pass_token is not Aspect.pass_token
    }


def _public(module: Any, base: type) -> list[tuple[str, Any]]:
    found = ((name, getattr(module, name)) for name in module.__all__)
    return [(n, o) for n, o in found if isinstance(o, type) and issubclass(o, base) and not isabstract(o)]
