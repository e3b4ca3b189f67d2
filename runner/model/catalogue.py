"""Which types a model may name: the actors and aspects that are installed, and those of the caller's own."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from inspect import isabstract
from typing import Any

import epicycle.actors
import epicycle.aspects
from epicycle.actors import Actor, Process
from epicycle.aspects import Aspect


@dataclass(frozen=True)
class Catalogue:
    """Actor and aspect types by name."""

    actors: dict[str, type[Actor]]
    aspects: dict[str, type[Aspect]]

    def with_types(self, types: Iterable[type]) -> Catalogue:
        """The catalogue with further types, by the names of their classes; of two with one name, the last counts."""
        actors, aspects = dict(self.actors), dict(self.aspects)
        for each in types:
            if issubclass(each, Actor):
                actors[each.__name__] = each
            elif issubclass(each, Aspect):
                aspects[each.__name__] = each
            else:
                raise TypeError(f"{each.__name__} is neither an Actor nor an Aspect")
        return Catalogue(actors, aspects)


@cache
def actor_types() -> dict[str, type[Actor]]:
    """Every actor that the house's public face offers, by name."""
    return {name: found for name, found in _public(epicycle.actors, Actor) if found not in (Actor, Process)}


@cache
def aspect_types() -> dict[str, type[Aspect]]:
    """Every aspect that the house's public face offers, by name; bases that define no behaviour are left out."""
    return {
        name: found for name, found in _public(epicycle.aspects, Aspect) if found.pass_token is not Aspect.pass_token
    }


def installed() -> Catalogue:
    """What the houses offer."""
    return Catalogue(actor_types(), aspect_types())


def _public(module: Any, base: type) -> list[tuple[str, Any]]:
    found = ((name, getattr(module, name)) for name in module.__all__)
    return [(n, o) for n, o in found if isinstance(o, type) and issubclass(o, base) and not isabstract(o)]
