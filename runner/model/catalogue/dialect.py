"""Dialect: the rules and types under a director."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, ClassVar


class Dialect:
    """Epicycle's own rules, and the base of others: under a director with ``like: NAME``, a subclass applies.

    A package offers one as an entry point ``NAME = "package.module:Class"`` of the group ``epicycle.dialects``.  The
    class is used as it is, without instances.
    """

    # What models call it.
    name: ClassVar[str] = "epicycle"
    # Whether a composite with a director counts as one actor that needs all its inputs: all its outputs depend on all
    # of them, whatever is behind; requests to an aspect that is such a composite wait for its turn; and what leaves
    # one with modes by a port is one channel, whichever refinement has sent it.
    is_strict: ClassVar[bool] = False

    @classmethod
    def types(cls) -> Iterable[type]:
        """Actors and aspects that take the place of others with the names of their classes."""
        return ()

    @classmethod
    def director(cls) -> Any:
        """The subclass of ``epicycle.runner.execution.engine.Director`` that fires a model of the dialect.

        None is the usual one.
        """
        return None
