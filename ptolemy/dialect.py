"""``like: ptolemy``."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from importlib import import_module
from types import ModuleType
from typing import Any

from epicycle.actors import Actor
from epicycle.aspects import Aspect
from epicycle.runner.catalogue import Catalogue, Dialect, built_in


class Ptolemy(Dialect):
    """The rules of Ptolemy II, and its actors where they differ from Epicycle's."""

    name = "ptolemy"
    is_strict = True

    @classmethod
    def types(cls) -> Iterable[type]:
        files = ("computing", "dictionary", "generators", "machine", "timing")
        modules = (import_module(f".{each}", __package__) for each in files)
        return [each for module in modules for each in vars(module).values() if _is_type_of(module, each)]

    @classmethod
    def director(cls) -> Any:
        from .posted import PostedDirector

        return PostedDirector


@cache
def known_types() -> Catalogue:
    """Epicycle's own actors and aspects, as they are under ``like: ptolemy``."""
    return built_in().like(Ptolemy)


def _is_type_of(module: ModuleType, found: object) -> bool:
    if not isinstance(found, type) or not issubclass(found, (Actor, Aspect)):
        return False
    return found.__module__ == module.__name__ and not found.__name__.startswith("_")
