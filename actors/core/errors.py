"""The root of all errors that Epicycle raises on purpose, and faults: what is wrong with something that was given."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import ClassVar, Self

Keys = tuple[str | int, ...]
Span = tuple[int, int]


class EpicycleError(Exception):
    """An error whose message is meant for the person at the keyboard."""


@dataclass(frozen=True, slots=True)
class Fault:
    """Something wrong with a value: the message, where in the value it is, and what would be right.

    ``keys`` lead to a part of a mapping or list; ``of_key``: the last key itself is wrong.  ``span`` is a part of the
    text there: its offset and length.  ``kind`` is a word for what is wrong, such as ``unit``, ``meant`` what to write
    there instead.
    """

    message: str
    keys: Keys = ()
    of_key: bool = False
    span: Span | None = None
    help: tuple[str, ...] = ()
    kind: str = ""
    meant: str = ""

    def within(self, *keys: str | int, prefix: str = "") -> Fault:
        """The fault of something that contains the value under these keys."""
        return replace(self, message=prefix + self.message, keys=(*keys, *self.keys))


class FaultError(EpicycleError):
    """What was given is wrong; ``faults`` are all that is wrong with it."""

    kind: ClassVar[str] = ""  # of its faults, unless they name another

    def __init__(
        self,
        message: str,
        keys: Keys = (),
        *,
        of_key: bool = False,
        span: Span | None = None,
        help: Iterable[str] = (),
        kind: str = "",
        meant: str = "",
    ) -> None:
        super().__init__(message)
        fault = Fault(message, tuple(keys), of_key, span, tuple(help), kind or self.kind, meant)
        self.faults: tuple[Fault, ...] = (fault,)

    @classmethod
    def several(cls, faults: Iterable[Fault]) -> Self:
        """One error for all of them."""
        found = tuple(faults)
        made = cls.__new__(cls)
        made.args = ("\n".join(fault.message for fault in found),)
        made.faults = found
        return made

    def __str__(self) -> str:
        return str(self.args[0])

    @property
    def message(self) -> str:
        """What is wrong, first of all."""
        return self.faults[0].message

    @property
    def keys(self) -> Keys:
        """Where in the value it is."""
        return self.faults[0].keys

    @property
    def help(self) -> tuple[str, ...]:
        """What would be right instead."""
        return self.faults[0].help

    def within(self, *keys: str | int, prefix: str = "") -> list[Fault]:
        """The faults of something that contains the value under these keys."""
        return [fault.within(*keys, prefix=prefix) for fault in self.faults]


class ParameterError(FaultError):
    """A value that a parameter does not accept; the message says what it accepts."""
