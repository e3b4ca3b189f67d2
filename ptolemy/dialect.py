"""``like: ptolemy``."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from importlib import import_module
from typing import Any

from epicycle.actors import Actor
from epicycle.aspects import Aspect
from epicycle.runner.model.catalogue import Catalogue, Dialect, built_in


class Ptolemy(Dialect):
    """The rules of Ptolemy II, and its actors where they differ from Epicycle's."""

    name = "ptolemy"
    is_strict = True

    @classmethod
    def types(cls) -> Iterable[type]:
        files = ("computing", "generators", "machine", "timing")
        modules = (import_module(f".{each}", __package__) for each in files)
        named = [(module.__name__, each) for module in modules for name, each in vars(module).items() if name[0] != "_"]
        types = [(module, each) for module, each in named if isinstance(each, type) and each.__module__ == module]
        return [each for _, each in types if issubclass(each, (Actor, Aspect))]

    @classmethod
    def director(cls) -> Any:
        from .posted import PostedDirector

        return PostedDirector


@cache
def known_types() -> Catalogue:
    """Epicycle's own actors and aspects, as they are under ``like: ptolemy``."""
    return built_in().like(Ptolemy)
